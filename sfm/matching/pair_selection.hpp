#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/matching/descriptor_matcher.hpp"
#include "sfm/matching/global_descriptor.hpp"
#include "sfm/matching/matches.hpp"

namespace trigmesh {

/// Which image pairs are worth matching.
enum class PairMode {
  kExhaustive,  ///< all
  kSequential,  ///< neighbours in order, and look-alikes far apart that may close a loop
  kRetrieval,   ///< the look-alikes of each image
  kAuto,        ///< small sets: all pairs that pass a preemptive match; larger: look-alikes (and
                ///< neighbours) that pass it
};

/// "exhaustive", "sequential", "retrieval", "auto".
[[nodiscard]] std::string_view to_string(PairMode mode);
[[nodiscard]] std::optional<PairMode> pair_mode_from_string(std::string_view name);

/// Whether the order of the images says which are near each other.
enum class ImageOrder { kUnordered, kSequence };

struct PairSelectionOptions {
  PairMode mode = PairMode::kAuto;
  ImageOrder order = ImageOrder::kUnordered;
  /// Neighbours after each image that are always paired with it in a sequence, > 0.
  std::size_t window = 8;
  /// Look-alikes of each image in retrieval and in automatic mode for large sets, > 0.
  std::size_t neighbors = 30;
  /// Look-alikes of each image outside the window in sequential mode; 0 turns loops off.
  std::size_t loop_neighbors = 5;
  /// Automatic mode looks at all pairs up to this many images.
  std::size_t max_exhaustive_images = 60;
  /// Preemptive matching compares so many of the coarsest features of each image, > 0, ...
  std::size_t preemptive_features = 400;
  /// ... a pair is kept when at least so many of them match ...
  std::size_t min_preemptive_matches = 4;
  /// ... or when it is among the best so many of one of its images and has at least one match.
  std::size_t best_preemptive_pairs = 6;
  GlobalDescriptorOptions global_descriptor{};

  [[nodiscard]] Result<> validate() const;
};

/// Pairs to be matched in full, sorted, each once, first < second. Images without features are in
/// no pair. All images must be of one kind. Does not depend on the executor. Measured cost and
/// recall: README.
[[nodiscard]] Result<std::vector<ImagePair>> select_pairs(std::span<const DescriptorIndex> images,
                                                          const PairSelectionOptions& options,
                                                          Executor& executor);

}  // namespace trigmesh
