#pragma once

#include <optional>

#include "sfm/geometry/similarity.hpp"
#include "sfm/mapping/map.hpp"
#include "sfm/mapping/track_table.hpp"

namespace trigmesh {

/// Where two maps overlap: the similarity that carries points of `b` into the world of `a`, from
/// tracks that have a landmark in both. Nothing when fewer than `min_common` of them agree within
/// `max_error_ratio` of the spread of the common landmarks, or fewer than half of them do.
[[nodiscard]] std::optional<Sim3> find_overlap(
    const Map& a, const Map& b, std::size_t min_common, double max_error_ratio, std::uint64_t seed);

/// Moves all views and landmarks of `b` into `a`. Landmarks of tracks that both have keep the
/// position of `a` and gain the observations of `b`.
void absorb(Map& a, const Map& b, const Sim3& a_from_b);

}  // namespace trigmesh
