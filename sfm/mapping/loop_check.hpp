#pragma once

#include <optional>
#include <span>

#include "sfm/mapping/map.hpp"
#include "sfm/matching/matches.hpp"

namespace trigmesh {

/// Whether a pair of registered views agrees with the map that grew without it: the median angle,
/// degrees, between the direction in which a keypoint is seen and the direction to the landmark
/// that its partner in the other view sees, over the matches of which one side has a landmark.
/// Drift of a map leaves a few degrees; a place that only looks like another one gives tens, or
/// more. Nothing when fewer than eight matches can tell. Both views must be registered.
[[nodiscard]] std::optional<double> disagreement_deg(const Map& map,
                                                     ImagePair pair,
                                                     std::span<const FeatureMatch> matches);

}  // namespace trigmesh
