#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/executor.hpp"
#include "sfm/matching/descriptor_matcher.hpp"

namespace trigmesh {

/// How images are summed up for retrieval.
struct GlobalDescriptorOptions {
  /// Visual words, [2, 1024].
  std::size_t words = 64;
  /// Only the first (coarsest) features of an image count, > 0.
  std::size_t features_per_image = 1500;
  /// Features per word from which the words are learned, over all images, > 0.
  std::size_t training_features_per_word = 150;
  /// Rounds of k-means, > 0.
  int rounds = 8;

  [[nodiscard]] Result<> validate() const;
};

/// One unit vector for each image (zero for an image without features); the dot product of two says
/// how much the images share. VLAD (Jegou et al., CVPR 2010) with each word normalised
/// (Arandjelovic, Zisserman, CVPR 2013), over words learned from the images themselves: spherical
/// k-means, or for bit strings k-majority (Grana et al., 2013). No randomness: training features
/// are taken evenly. All images must be of one kind. The result does not depend on the executor.
[[nodiscard]] std::vector<Eigen::VectorXf> describe_images(std::span<const DescriptorIndex> images,
                                                           const GlobalDescriptorOptions& options,
                                                           Executor& executor);

}  // namespace trigmesh
