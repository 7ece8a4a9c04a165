#include "sfm/matching/pair_selection.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr std::array<std::pair<PairMode, std::string_view>, 4> kModeNames = {{
    {PairMode::kExhaustive, "exhaustive"},
    {PairMode::kSequential, "sequential"},
    {PairMode::kRetrieval, "retrieval"},
    {PairMode::kAuto, "auto"},
}};

ImagePair make_pair(std::size_t i, std::size_t j) {
  return {id_of<ViewId>(std::min(i, j)), id_of<ViewId>(std::max(i, j))};
}

void sort_unique(std::vector<ImagePair>& pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

std::vector<ImagePair> all_pairs(std::size_t count) {
  std::vector<ImagePair> out;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      out.push_back(make_pair(i, j));
    }
  }
  return out;
}

std::vector<ImagePair> pairs_in_window(std::size_t count, std::size_t window) {
  std::vector<ImagePair> out;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count && j - i <= window; ++j) {
      out.push_back(make_pair(i, j));
    }
  }
  return out;
}

/// Each image with the `neighbors` most similar ones that are more than `least_gap` places away.
std::vector<ImagePair> look_alikes(std::span<const DescriptorIndex> images,
                                   const GlobalDescriptorOptions& options,
                                   std::size_t neighbors,
                                   std::size_t least_gap,
                                   Executor& executor) {
  if (neighbors == 0) {
    return {};
  }
  const std::vector<Eigen::VectorXf> described = describe_images(images, options, executor);
  std::vector<std::vector<ImagePair>> of_image(images.size());
  executor.for_each_index(images.size(), [&](std::size_t i) {
    std::vector<std::pair<float, std::size_t>>
        ranked;  // (-similarity, image): ties go to the lower index
    for (std::size_t j = 0; j < images.size(); ++j) {
      const std::size_t gap = i > j ? i - j : j - i;
      if (gap > least_gap && images[i].size() > 0 && images[j].size() > 0) {
        ranked.emplace_back(-described[i].dot(described[j]), j);
      }
    }
    const std::size_t kept = std::min(neighbors, ranked.size());
    std::partial_sort(
        ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(kept), ranked.end());
    for (std::size_t k = 0; k < kept; ++k) {
      of_image[i].push_back(make_pair(i, ranked[k].second));
    }
  });
  std::vector<ImagePair> out;
  for (const auto& pairs : of_image) {
    out.insert(out.end(), pairs.begin(), pairs.end());
  }
  return out;
}

/// The pairs of which enough coarse features match (Wu, Towards linear-time incremental structure
/// from motion, 3DV 2013, section 3), and the best of each image.
std::vector<ImagePair> pass_preemptive(std::span<const DescriptorIndex> images,
                                       const std::vector<ImagePair>& candidates,
                                       const PairSelectionOptions& options,
                                       Executor& executor) {
  std::vector<std::size_t> matched(candidates.size());
  executor.for_each_index(candidates.size(), [&](std::size_t c) {
    matched[c] = match_descriptors(images[index(candidates[c].first)],
                                   images[index(candidates[c].second)],
                                   {.max_features = options.preemptive_features})
                     .size();
  });
  std::vector<ImagePair> out;
  std::vector<std::vector<std::pair<std::size_t, std::size_t>>> of_image(
      images.size());  // (matches, candidate)
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    if (matched[c] >= options.min_preemptive_matches) {
      out.push_back(candidates[c]);
    }
    if (matched[c] > 0) {
      of_image[index(candidates[c].first)].emplace_back(matched[c], c);
      of_image[index(candidates[c].second)].emplace_back(matched[c], c);
    }
  }
  for (auto& ranked : of_image) {
    std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    for (std::size_t k = 0; k < std::min(options.best_preemptive_pairs, ranked.size()); ++k) {
      out.push_back(candidates[ranked[k].second]);
    }
  }
  return out;
}

std::vector<ImagePair> select_automatically(std::span<const DescriptorIndex> images,
                                            const PairSelectionOptions& options,
                                            Executor& executor) {
  std::vector<ImagePair> candidates =
      images.size() <= options.max_exhaustive_images
          ? all_pairs(images.size())
          : look_alikes(images, options.global_descriptor, options.neighbors, 0, executor);
  sort_unique(candidates);
  std::vector<ImagePair> out = pass_preemptive(images, candidates, options, executor);
  if (options.order == ImageOrder::kSequence) {
    const auto near = pairs_in_window(images.size(), options.window);
    out.insert(out.end(), near.begin(), near.end());
  }
  return out;
}

}  // namespace

std::string_view to_string(PairMode mode) {
  for (const auto& [known, name] : kModeNames) {
    if (known == mode) {
      return name;
    }
  }
  return "auto";
}

std::optional<PairMode> pair_mode_from_string(std::string_view name) {
  for (const auto& [mode, known] : kModeNames) {
    if (known == name) {
      return mode;
    }
  }
  return std::nullopt;
}

Result<> PairSelectionOptions::validate() const {
  if (window == 0 || neighbors == 0 || preemptive_features == 0) {
    return fail(ErrorCode::kInvalidArgument,
                "window {}, neighbors {} and preemptive_features {} must be above 0",
                window,
                neighbors,
                preemptive_features);
  }
  return global_descriptor.validate();
}

Result<std::vector<ImagePair>> select_pairs(std::span<const DescriptorIndex> images,
                                            const PairSelectionOptions& options,
                                            Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  std::vector<ImagePair> pairs;
  switch (options.mode) {
    case PairMode::kExhaustive:
      pairs = all_pairs(images.size());
      break;
    case PairMode::kSequential: {
      pairs = pairs_in_window(images.size(), options.window);
      const auto loops = look_alikes(
          images, options.global_descriptor, options.loop_neighbors, options.window, executor);
      pairs.insert(pairs.end(), loops.begin(), loops.end());
      break;
    }
    case PairMode::kRetrieval:
      pairs = look_alikes(images, options.global_descriptor, options.neighbors, 0, executor);
      break;
    case PairMode::kAuto:
      pairs = select_automatically(images, options, executor);
      break;
  }
  std::erase_if(pairs, [&](const ImagePair& pair) {
    return images[index(pair.first)].size() == 0 || images[index(pair.second)].size() == 0;
  });
  sort_unique(pairs);
  return pairs;
}

}  // namespace trigmesh
