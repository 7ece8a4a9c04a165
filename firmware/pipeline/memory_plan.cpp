#include "firmware/pipeline/memory_plan.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace trigmesh {

namespace {

// Program, libraries and small things.
constexpr std::uint64_t kBaseBytes = 100'000'000;
// File, decoded colour and grey picture, pyramid of floats with its differences, per pixel of the
// photograph. Measured with peak memory of a single extraction, rounded up.
constexpr std::uint64_t kBytesPerPixel = 70;
constexpr std::uint64_t kBytesPerPixelUpsampled = 240;
// Keypoint, descriptor, its second copy for matching, colour, place in the matches and tracks.
constexpr std::uint64_t kBytesPerKeypoint = 600;
constexpr int kFewestKeypoints = 1000;

std::uint64_t bytes_needed(const MemoryDemand& demand,
                           const FeatureOptions& features,
                           int threads) {
  const std::uint64_t per_pixel = features.upsample ? kBytesPerPixelUpsampled : kBytesPerPixel;
  const std::uint64_t extraction = static_cast<std::uint64_t>(demand.largest_image_pixels) *
                                   per_pixel * static_cast<std::uint64_t>(threads);
  const std::uint64_t stored =
      demand.images * static_cast<std::uint64_t>(features.max_keypoints) * kBytesPerKeypoint;
  return kBaseBytes + extraction + stored;
}

}  // namespace

Result<MemoryPlan> plan_memory(const MemoryDemand& demand,
                               const FeatureOptions& wanted,
                               std::uint64_t limit_bytes) {
  MemoryPlan plan{wanted, demand.threads, {}};
  if (limit_bytes == 0) {
    return plan;
  }
  const auto fits = [&](int threads) {
    return bytes_needed(demand, plan.features, threads) <= limit_bytes;
  };
  if (plan.features.upsample && !fits(1)) {
    plan.features.upsample = false;
    plan.lowered.emplace_back(
        "to keep the memory limit, images were not doubled in size before looking for features");
  }
  while (!fits(1) && plan.features.max_keypoints > kFewestKeypoints) {
    plan.features.max_keypoints = std::max(kFewestKeypoints, plan.features.max_keypoints / 2);
  }
  if (plan.features.max_keypoints != wanted.max_keypoints) {
    plan.lowered.push_back(fmt::format(
        "to keep the memory limit, at most {} instead of {} features were kept per image",
        plan.features.max_keypoints,
        wanted.max_keypoints));
  }
  if (!fits(1)) {
    return fail(ErrorCode::kLimitExceeded,
                "cannot work within {} MB: {} images of up to {} megapixels need at least {} MB; "
                "raise --memory-limit, or use fewer "
                "or smaller images",
                limit_bytes / 1'000'000,
                demand.images,
                (demand.largest_image_pixels + 999'999) / 1'000'000,
                bytes_needed(demand, plan.features, 1) / 1'000'000 + 1);
  }
  while (!fits(plan.extraction_threads)) {
    --plan.extraction_threads;
  }
  return plan;
}

}  // namespace trigmesh
