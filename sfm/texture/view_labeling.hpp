#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sfm/texture/face_views.hpp"

namespace trigmesh {

inline constexpr std::uint32_t kNoLabel = std::numeric_limits<std::uint32_t>::max();

/// One label that a face may take, at a price.
struct LabelCandidate {
  std::uint32_t label = 0;
  std::int32_t cost = 0;  ///< [0, kLargestLabelCost]
};

inline constexpr std::int32_t kLargestLabelCost = 1000;

/// Which view for which face: minimise
///   E(l) = sum_f cost_f(l_f) + smoothness * #{neighbours f, g with labels: l_f != l_g}
/// over labels among each face's candidates. Whole numbers, so that the minimum does not depend on
/// the order of additions.
struct LabelingProblem {
  std::vector<std::size_t> offsets;        ///< face f owns candidates [offsets[f], offsets[f + 1])
  std::vector<LabelCandidate> candidates;  ///< ascending by label within a face
  std::vector<std::array<std::uint32_t, 3>> neighbors;  ///< see face_neighbors
  std::uint32_t label_count = 0;
  std::int32_t smoothness = 0;

  [[nodiscard]] std::span<const LabelCandidate> of(std::size_t face) const {
    return std::span(candidates).subspan(offsets[face], offsets[face + 1] - offsets[face]);
  }
};

/// The cost of a view falls with the square root of its quality relative to the face's best view;
/// the `max_candidates` best views of each face are kept.
[[nodiscard]] LabelingProblem make_labeling_problem(
    const FaceViews& faces,
    std::vector<std::array<std::uint32_t, 3>> neighbors,
    std::uint32_t view_count,
    std::int32_t smoothness,
    std::size_t max_candidates);

/// E(labels). Faces with kNoLabel and their edges count nothing.
[[nodiscard]] std::int64_t labeling_energy(const LabelingProblem& problem,
                                           std::span<const std::uint32_t> labels);

/// A local minimum of E with respect to expansion moves (within a factor of 2 of the global one
/// when every label is a candidate everywhere), or what `sweeps` passes over all labels reach.
/// Starts from the cheapest label of each face; faces without a candidate get kNoLabel.
/// Deterministic. Each move is a minimum cut over the faces that have the label as candidate only.
[[nodiscard]] std::vector<std::uint32_t> label_faces(const LabelingProblem& problem, int sweeps);

}  // namespace trigmesh
