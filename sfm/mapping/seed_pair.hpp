#pragma once

#include <optional>

#include "firmware/base/executor.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/mapping/image_store.hpp"

namespace trigmesh {

/// The two views that a map begins with; the first one is the world.
struct SeedPair {
  ImagePair pair;
  Rigid3 second_from_first;  ///< translation of length one
  std::size_t landmarks = 0;
  double median_angle_rad = 0.0;
};

/// Chooses the pair to begin with among images that no map has, as in the paper (E = K2^T F K1,
/// four decompositions, the one with points in front of both cameras) but on the pair that is best
/// conditioned, not blindly on images 1 and 2: the strongest pairs are tried, and the one whose
/// matches triangulate best wins (sum over its points of the triangulation angle, capped, so that
/// many points at a moderate angle beat few at a large one). `cameras` are the present intrinsics.
/// Nothing when no pair has `min_seed_landmarks` points with parallax: motion is degenerate so far.
[[nodiscard]] std::optional<SeedPair> choose_seed_pair(const ImageStore& store,
                                                       std::span<const Camera> cameras,
                                                       const MapperOptions& options,
                                                       Executor& executor);

}  // namespace trigmesh
