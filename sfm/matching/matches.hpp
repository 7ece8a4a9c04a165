#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "sfm/scene/ids.hpp"

namespace trigmesh {

/// Keypoint `first` of one image looks like keypoint `second` of the other.
struct FeatureMatch {
  FeatureIndex first{};
  FeatureIndex second{};

  auto operator<=>(const FeatureMatch&) const = default;
};

/// What the matches of an image pair say about the two cameras.
enum class TwoViewKind {
  kNone,          ///< too few matches agree with any model
  kGeneral,       ///< fundamental matrix: translation and depth variation
  kPlanar,        ///< one plane fills the matches; still has parallax
  kPureRotation,  ///< the camera turned on the spot (homography K R K^-1): no parallax
  kWatermark,     ///< matches stand at the same pixels near the border: an overlay, not the scene
  kDuplicate,     ///< the same picture twice (identity within a fraction of a pixel)
  kLookAlike,     ///< another place that looks alike: contradicts the frames in between
};

/// "none", "general", "planar", "pure_rotation", "watermark", "duplicate", "look_alike".
[[nodiscard]] std::string_view to_string(TwoViewKind kind);

/// Whether the matches of such a pair are points of one scene.
[[nodiscard]] bool shows_one_scene(TwoViewKind kind);

/// A verified image pair.
struct TwoViewGeometry {
  TwoViewKind kind = TwoViewKind::kNone;
  /// second^T F first = 0 in undistorted homogeneous pixels.
  Eigen::Matrix3d fundamental = Eigen::Matrix3d::Zero();
  std::vector<FeatureMatch> inliers;
  std::size_t candidates = 0;          ///< putative matches before verification
  std::size_t homography_inliers = 0;  ///< how many matches one homography explains
  /// second ~ homography * first, for those matches; zero when none was found.
  Eigen::Matrix3d homography = Eigen::Matrix3d::Zero();
};

/// A pair of images by their position in the input, first < second.
struct ImagePair {
  ViewId first{};
  ViewId second{};

  auto operator<=>(const ImagePair&) const = default;
};

}  // namespace trigmesh
