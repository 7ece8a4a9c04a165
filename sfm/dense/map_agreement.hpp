#pragma once

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

/// A depth map and where it was taken.
struct PosedDepthMap {
  DepthMap map;
  Rigid3 cam_from_world;
};

/// When the maps of two views speak of the same surface.
struct AgreementOptions {
  /// Largest distance between a pixel and where it lands after going to the other view and back
  /// from the surface there, pixels, (0, 10].
  float max_round_trip_px = 1.0F;
  /// Largest difference of the depths in the other view, over the depth, (0, 0.5].
  float max_depth_ratio = 0.01F;
  /// Largest angle between the normals, degrees, (0, 180].
  float max_normal_deg = 45.0F;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

/// What another map says about a pixel of a reference map.
enum class MapVerdict {
  kSilent,     ///< outside, nothing known there, or hidden behind a nearer surface
  kAgrees,     ///< the same surface
  kConflicts,  ///< the other view looks through the point at something behind it
};

struct MapOpinion {
  MapVerdict verdict = MapVerdict::kSilent;
  int x = 0;  ///< the pixel of the other map; set unless silent
  int y = 0;
  /// Depth in the reference of the surface of the other map; set when it agrees.
  float depth_in_reference = 0.0F;
};

/// Asks one map about the pixels of another. Thread-compatible; both maps outlive it.
class MapComparison {
 public:
  MapComparison(const PosedDepthMap& reference,
                const PosedDepthMap& other,
                const AgreementOptions& options);

  /// About pixel (x, y) of the reference, whose depth is known.
  [[nodiscard]] MapOpinion ask(int x, int y) const;

 private:
  const DepthMap& reference_;
  const DepthMap& other_;
  AgreementOptions options_;
  float min_normal_cosine_ = 0.0F;
  Eigen::Matrix3f rotation_;  ///< other pixel ~ rotation p z + epipole, of reference pixel p
  Eigen::Vector3f epipole_;
  Eigen::Matrix3f back_rotation_;
  Eigen::Vector3f back_epipole_;
  Eigen::Matrix3f other_from_reference_;  ///< of directions, camera frames
};

}  // namespace trigmesh
