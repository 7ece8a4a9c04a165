#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "sfm/coverage/face_coverage.hpp"
#include "sfm/coverage/gap_kind.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// A small piece of surface that is missing or weak.
struct GapPiece {
  GapKind kind = GapKind::kWeak;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, outwards
  double area = 0.0;                                 ///< squared scene units
};

/// Pieces that lie together and look the same way.
struct SurfaceGap {
  std::vector<GapPiece> pieces;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< mean of the pieces by area
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, the same
  double area = 0.0;
  double hole_area = 0.0;  ///< of the holes in it
};

/// The gaps of the subject, and how large the subject is.
struct SurfaceGaps {
  std::vector<SurfaceGap> gaps;  ///< by falling area
  double subject_area = 0.0;     ///< of its faces
};

/// Finds where a surface is open or weak. Only the subject counts: what lies in the picture of at
/// least half as many views as the median of what the views show; what is around it is in few
/// pictures, and nobody wanted it. A border is no hole where the surface ends because the
/// pictures do (less than 0.8 of its vertices belong to the subject), nor when it is the longest of
/// a piece of surface that is more flat than round: a relief, whose area vectors add up to more
/// than 0.75 of its area, as those of a cap of a sphere up to 60 degrees from its pole. `coverage`:
/// of measure_coverage for the same mesh and views.
[[nodiscard]] SurfaceGaps find_gaps(const TriangleMesh& mesh,
                                    std::span<const DenseView> views,
                                    std::span<const FaceCoverage> coverage);

}  // namespace trigmesh
