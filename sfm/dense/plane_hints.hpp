#pragma once

#include <vector>

#include "sfm/dense/patch_match.hpp"
#include "sfm/dense/patch_match_kernel.hpp"

namespace trigmesh {

/// The surfaces that the maps of the sources (StereoProblem::source_maps) put in front of the
/// reference, as planes of its pixels: two layers of the size of the reference, each pixel with the
/// most confident surfaces that differ in depth; inverse depth 0: none. Nothing is hidden by
/// anything: matching decides.
[[nodiscard]] std::vector<std::vector<PlaneHypothesis>> plane_hints(const StereoProblem& problem);

}  // namespace trigmesh
