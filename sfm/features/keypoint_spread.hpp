#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace trigmesh {

/// What the choice of keypoints looks at.
struct SpreadCandidate {
  float x_px = 0.0F;
  float y_px = 0.0F;
  float strength = 0.0F;  ///< larger is preferred
};

/// Chooses at most `count` candidates spread over an image of width x height px: the image is cut
/// into square cells of some eight points each, every cell gives its strongest, then its second
/// strongest, and so on until `count` is reached; in the last round the strongest of all cells go
/// first. Returns indices in that order, so a prefix is spread too. Deterministic; equal strengths
/// are taken in order of index. O(n log n).
[[nodiscard]] std::vector<std::size_t> spread_keypoints(std::span<const SpreadCandidate> candidates,
                                                        int width_px,
                                                        int height_px,
                                                        std::size_t count);

}  // namespace trigmesh
