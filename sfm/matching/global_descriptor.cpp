#include "sfm/matching/global_descriptor.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

using internal::DescriptorRows;

/// Length of a visual word made of bytes 0..127, so that the nearest word is the one with the
/// largest dot product.
constexpr double kWordLength = 256.0;
constexpr double kLargestByte = 127.0;

/// Descriptors of our own, in the form in which the kernel reads them.
struct OwnedRows {
  DescriptorRows rows;
  std::vector<std::uint8_t> bytes;

  OwnedRows(const DescriptorRows& like, std::size_t count)
      : rows(like), bytes(count * like.descriptor_bytes) {
    rows.count = count;
    rows.data = bytes.data();
  }

  std::uint8_t* row(std::size_t i) { return bytes.data() + i * rows.descriptor_bytes; }
};

/// Components of a descriptor as numbers: its bytes, or its bits.
std::size_t dimension(const DescriptorRows& rows) {
  return rows.metric == DescriptorMetric::kHamming ? 8 * rows.descriptor_bytes
                                                   : rows.descriptor_bytes;
}

void add_components(const DescriptorRows& rows, std::size_t i, float* sum) {
  const std::uint8_t* bytes = rows.row(i);
  if (rows.metric == DescriptorMetric::kHamming) {
    for (std::size_t bit = 0; bit < 8 * rows.descriptor_bytes; ++bit) {
      sum[bit] += static_cast<float>((bytes[bit / 8] >> (bit % 8)) & 1);
    }
    return;
  }
  for (std::size_t k = 0; k < rows.descriptor_bytes; ++k) {
    sum[k] += static_cast<float>(bytes[k]);
  }
}

/// The word that stands for the sum of `count` descriptors: their direction, or their majority.
void make_word(DescriptorMetric metric,
               const Eigen::VectorXf& sum,
               std::size_t count,
               std::uint8_t* word) {
  if (metric == DescriptorMetric::kHamming) {
    std::fill_n(word, static_cast<std::size_t>(sum.size()) / 8, std::uint8_t{0});
    for (Eigen::Index bit = 0; bit < sum.size(); ++bit) {
      if (2.0F * sum[bit] > static_cast<float>(count)) {
        word[bit / 8] = static_cast<std::uint8_t>(word[bit / 8] | (1U << (bit % 8)));
      }
    }
    return;
  }
  const double scale = kWordLength / std::max(static_cast<double>(sum.norm()), 1e-9);
  for (Eigen::Index k = 0; k < sum.size(); ++k) {
    word[k] = static_cast<std::uint8_t>(
        std::min(kLargestByte, std::round(scale * static_cast<double>(sum[k]))));
  }
}

/// Nearest word of each of the first `count` descriptors.
std::vector<std::uint32_t> assign(const DescriptorRows& rows,
                                  std::size_t count,
                                  const OwnedRows& words) {
  const internal::InterleavedRows interleaved = internal::interleave(words.rows);
  const internal::ScanResult scan =
      internal::scan_all_pairs(rows, count, words.rows, interleaved, words.rows.count);
  std::vector<std::uint32_t> out(count);
  std::transform(scan.rows.begin(), scan.rows.end(), out.begin(), [](const auto& row) {
    return row.position;
  });
  return out;
}

/// `count` descriptors taken evenly from the coarse features of all images.
OwnedRows take_evenly(std::span<const DescriptorIndex> images,
                      const DescriptorRows& like,
                      std::size_t features_per_image,
                      std::size_t count) {
  std::vector<const std::uint8_t*> all;
  for (const DescriptorIndex& image : images) {
    for (std::size_t i = 0; i < std::min(image.size(), features_per_image); ++i) {
      all.push_back(image.rows().row(i));
    }
  }
  const std::size_t taken = std::min(count, all.size());
  OwnedRows out(like, taken);
  for (std::size_t i = 0; i < taken; ++i) {
    std::memcpy(out.row(i), all[i * all.size() / taken], like.descriptor_bytes);
  }
  return out;
}

OwnedRows learn_words(const OwnedRows& training, const GlobalDescriptorOptions& options) {
  const std::size_t count = std::min(options.words, training.rows.count);
  OwnedRows words(training.rows, count);
  for (std::size_t w = 0; w < count; ++w) {
    std::memcpy(words.row(w),
                training.rows.row(w * training.rows.count / count),
                training.rows.descriptor_bytes);
  }
  for (int round = 0; round < options.rounds; ++round) {
    const std::vector<std::uint32_t> nearest = assign(training.rows, training.rows.count, words);
    std::vector<Eigen::VectorXf> sums(
        count, Eigen::VectorXf::Zero(static_cast<Eigen::Index>(dimension(training.rows))));
    std::vector<std::size_t> members(count, 0);
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      add_components(training.rows, i, sums[nearest[i]].data());
      ++members[nearest[i]];
    }
    for (std::size_t w = 0; w < count; ++w) {
      if (members[w] > 0) {
        make_word(training.rows.metric, sums[w], members[w], words.row(w));
      }
    }
  }
  return words;
}

/// Sum of the differences from the nearest word, word by word.
Eigen::VectorXf describe(const DescriptorIndex& image,
                         const OwnedRows& words,
                         std::size_t features_per_image) {
  const auto size = static_cast<Eigen::Index>(dimension(words.rows));
  const std::size_t count = std::min(image.size(), features_per_image);
  const std::vector<std::uint32_t> nearest = assign(image.rows(), count, words);
  Eigen::MatrixXf sums = Eigen::MatrixXf::Zero(size, static_cast<Eigen::Index>(words.rows.count));
  Eigen::VectorXf members = Eigen::VectorXf::Zero(sums.cols());
  for (std::size_t i = 0; i < count; ++i) {
    add_components(image.rows(), i, sums.col(nearest[i]).data());
    members[nearest[i]] += 1.0F;
  }
  for (Eigen::Index w = 0; w < sums.cols(); ++w) {
    Eigen::VectorXf word = Eigen::VectorXf::Zero(size);
    add_components(words.rows, static_cast<std::size_t>(w), word.data());
    sums.col(w) -= members[w] * word;
    const float length = sums.col(w).norm();
    if (length > 0.0F) {
      sums.col(w) /= length;
    }
  }
  Eigen::VectorXf out = sums.reshaped();
  if (out.norm() > 0.0F) {
    out.normalize();
  }
  return out;
}

}  // namespace

Result<> GlobalDescriptorOptions::validate() const {
  if (words < 2 || words > 1024) {
    return fail(ErrorCode::kInvalidArgument, "words is {}, must be in [2, 1024]", words);
  }
  if (features_per_image == 0 || training_features_per_word == 0 || rounds <= 0) {
    return fail(
        ErrorCode::kInvalidArgument,
        "features_per_image {}, training_features_per_word {} and rounds {} must be above 0",
        features_per_image,
        training_features_per_word,
        rounds);
  }
  return {};
}

std::vector<Eigen::VectorXf> describe_images(std::span<const DescriptorIndex> images,
                                             const GlobalDescriptorOptions& options,
                                             Executor& executor) {
  std::vector<Eigen::VectorXf> out(images.size());
  const auto filled = std::find_if(
      images.begin(), images.end(), [](const auto& image) { return image.size() > 0; });
  if (filled == images.end()) {
    return out;
  }
  const OwnedRows training = take_evenly(images,
                                         filled->rows(),
                                         options.features_per_image,
                                         options.words * options.training_features_per_word);
  const OwnedRows words = learn_words(training, options);
  const auto size = static_cast<Eigen::Index>(words.rows.count * dimension(words.rows));
  executor.for_each_index(images.size(), [&](std::size_t i) {
    if (images[i].size() == 0) {
      out[i] = Eigen::VectorXf::Zero(size);
      return;
    }
    TM_CHECK(images[i].rows().metric == words.rows.metric &&
             images[i].rows().descriptor_bytes == words.rows.descriptor_bytes);
    out[i] = describe(images[i], words, options.features_per_image);
  });
  return out;
}

}  // namespace trigmesh
