#include "sfm/moving/moving_keypoints.hpp"

#include <algorithm>
#include <utility>

namespace trigmesh {

namespace {

/// Position of a keypoint with evidence, and whether it moved.
struct Witness {
  float x_px = 0.0F;
  float y_px = 0.0F;
  bool moved = false;
};

std::vector<Witness> witnesses_of(std::span<const FeatureEvidence> evidence) {
  std::vector<Witness> witnesses;
  for (const FeatureEvidence& one : evidence) {
    if (one.agreeing + one.contradicting > 0) {
      witnesses.push_back({one.keypoint.x_px, one.keypoint.y_px, has_moved(one)});
    }
  }
  return witnesses;
}

bool lies_among_moved(const Keypoint& keypoint,
                      std::span<const Witness> witnesses,
                      const SurroundingsOptions& options,
                      std::vector<std::pair<float, bool>>& near) {
  const auto limit = static_cast<float>(options.max_distance_px * options.max_distance_px);
  near.clear();
  for (const Witness& witness : witnesses) {
    const float dx = witness.x_px - keypoint.x_px;
    const float dy = witness.y_px - keypoint.y_px;
    const float distance = dx * dx + dy * dy;
    if (distance <= limit) {
      near.emplace_back(distance, witness.moved);
    }
  }
  const std::size_t asked = std::min(options.neighbors, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(asked), near.end());
  const auto moved = std::count_if(near.begin(),
                                   near.begin() + static_cast<std::ptrdiff_t>(asked),
                                   [](const auto& one) { return one.second; });
  return asked > 0 &&
         static_cast<double>(moved) >= options.min_moved_ratio * static_cast<double>(asked);
}

}  // namespace

Result<> SurroundingsOptions::validate() const {
  if (neighbors < 1 || min_moved < 1) {
    return fail(ErrorCode::kInvalidArgument,
                "neighbors is {} and min_moved {}, not both >= 1",
                neighbors,
                min_moved);
  }
  if (!(max_distance_px > 0.0)) {
    return fail(ErrorCode::kInvalidArgument, "max_distance_px is {}, not > 0", max_distance_px);
  }
  if (!(min_moved_ratio > 0.5 && min_moved_ratio <= 1.0)) {
    return fail(
        ErrorCode::kInvalidArgument, "min_moved_ratio is {}, not in (0.5, 1]", min_moved_ratio);
  }
  return {};
}

std::vector<std::uint8_t> moving_keypoints(std::span<const Keypoint> keypoints,
                                           std::span<const FeatureEvidence> evidence,
                                           const SurroundingsOptions& options) {
  std::vector<std::uint8_t> moving(keypoints.size(), 0);
  const std::vector<Witness> witnesses = witnesses_of(evidence);
  const auto moved = std::count_if(
      witnesses.begin(), witnesses.end(), [](const Witness& witness) { return witness.moved; });
  if (static_cast<std::size_t>(moved) < options.min_moved) {
    return moving;
  }
  std::vector<std::pair<float, bool>> near;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    moving[i] = lies_among_moved(keypoints[i], witnesses, options, near) ? 1 : 0;
  }
  return moving;
}

}  // namespace trigmesh
