#include "sfm/coverage/surface_coverage.hpp"

#include <algorithm>

#include "sfm/coverage/face_coverage.hpp"

namespace trigmesh {
namespace {

constexpr double kLeastGapRatio = 0.001;
constexpr std::size_t kMostGaps = 20;

}  // namespace

SurfaceCoverage measure_surface_coverage(const TriangleMesh& mesh,
                                         std::span<const DenseView> views,
                                         Executor& executor) {
  SurfaceCoverage result;
  if (views.empty() || mesh.faces.empty()) {
    return result;
  }
  const SurfaceGaps found = find_gaps(mesh, views, measure_coverage(mesh, views, executor));
  const Eigen::Vector3d up = up_of_views(views);
  double whole_area = found.subject_area;
  for (std::size_t i = 0; i < std::min(found.gaps.size(), kMostGaps); ++i) {
    const SurfaceGap& gap = found.gaps[i];
    if (gap.area < kLeastGapRatio * found.subject_area) {
      break;
    }
    executor.stop_point();
    if (const auto direction = find_shooting_direction(gap, mesh, views, up, executor)) {
      whole_area += direction->visible_area * gap.hole_area / gap.area;
      result.gaps.push_back({2.0 * gap.hole_area > gap.area ? GapKind::kHole : GapKind::kWeak,
                             gap.center,
                             0.0,
                             *direction});
    }
  }
  for (ReachableGap& gap : result.gaps) {
    gap.area_ratio = gap.direction.visible_area / whole_area;
    result.gap_ratio += gap.area_ratio;
  }
  std::stable_sort(
      result.gaps.begin(), result.gaps.end(), [](const ReachableGap& a, const ReachableGap& b) {
        return a.area_ratio > b.area_ratio;
      });
  return result;
}

}  // namespace trigmesh
