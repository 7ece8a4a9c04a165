#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/features/features.hpp"

namespace trigmesh {

/// What extraction and matching may use so that a memory limit is kept.
struct MemoryPlan {
  FeatureOptions features;
  int extraction_threads = 1;
  std::vector<std::string> lowered;  ///< one sentence for each quality setting that was lowered
};

/// What the plan depends on.
struct MemoryDemand {
  std::size_t images = 0;
  std::int64_t largest_image_pixels = 0;
  int threads = 1;
};

/// Lowers, in this order and only as far as needed: photographs worked on at once (costs time
/// only), doubling of the image size, keypoints per image (in halves, to no fewer than 1000). The
/// last two depend on the limit, never on the number of threads. `limit_bytes` 0 means no limit.
/// kLimitExceeded when even the lowest settings need more.
[[nodiscard]] Result<MemoryPlan> plan_memory(const MemoryDemand& demand,
                                             const FeatureOptions& wanted,
                                             std::uint64_t limit_bytes);

}  // namespace trigmesh
