#pragma once

#include <span>

#include "firmware/pipeline/report.hpp"
#include "firmware/pipeline/report_sections.hpp"
#include "sfm/coverage/surface_coverage.hpp"
#include "sfm/dense/dense_view.hpp"

namespace trigmesh {

/// The verdict at the end, in words for who stands there with the camera: whether the thing is
/// shot, and of the five largest gaps from where to shoot them. Ready: at least half of the
/// photographs are registered, all gaps that more photographs would close come to at most 4 % of
/// the surface, and none to more than 2 % (sfm/coverage/README.md has what real surfaces come to).
/// `views`: those of the coverage.
[[nodiscard]] FinishSection judge_finish(const SurfaceCoverage& coverage,
                                         std::span<const DenseView> views,
                                         Verdict registration);

}  // namespace trigmesh
