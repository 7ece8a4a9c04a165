#include "sfm/matching/pair_matching.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/matching/synthetic_pair.hpp"

namespace trigmesh {
namespace {

using test_support::make_pair;
using test_support::Random;
using test_support::SyntheticPair;

constexpr std::size_t kDescriptorBytes = 128;

std::vector<std::uint8_t> random_descriptor(Random& random) {
  std::vector<std::uint8_t> descriptor(kDescriptorBytes);
  for (auto& byte : descriptor) {
    byte = static_cast<std::uint8_t>(random.below(40));
  }
  return descriptor;
}

/// An image whose keypoint i has appearance i modulo `looks`; `seed` decides the appearances.
FeatureSet describe(std::size_t count, std::size_t looks, std::uint64_t seed) {
  Random random(seed);
  FeatureSet features;
  features.kind = FeatureKind::kSift;
  features.descriptor_bytes = kDescriptorBytes;
  features.keypoints.resize(count);
  std::vector<std::vector<std::uint8_t>> appearances;
  for (std::size_t i = 0; i < std::min(count, looks); ++i) {
    appearances.push_back(random_descriptor(random));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto& descriptor = appearances[i % looks];
    features.descriptors.insert(features.descriptors.end(), descriptor.begin(), descriptor.end());
  }
  return features;
}

MatchableImage matchable(const FeatureSet& features,
                         const std::vector<Eigen::Vector2d>& points_px,
                         const SyntheticPair& pair) {
  return {DescriptorIndex::build(features).value(),
          points_px,
          SyntheticPair::kWidth,
          SyntheticPair::kHeight,
          pair.calibration};
}

std::size_t count_true(const std::vector<FeatureMatch>& matches) {
  return static_cast<std::size_t>(std::count_if(
      matches.begin(), matches.end(), [](const auto& m) { return m.first == m.second; }));
}

TEST(PairMatching, AlongEpipolarLinesItFindsMoreThanTheCoarseFeaturesAlone) {
  const SyntheticPair pair = make_pair({.true_count = 600});
  const FeatureSet first = describe(600, 600, 1);
  const FeatureSet second = describe(600, 600, 1);
  PairMatchingOptions options;
  options.coarse_features = 150;
  const TwoViewGeometry geometry =
      match_pair(matchable(first, pair.first, pair), matchable(second, pair.second, pair), options);
  EXPECT_EQ(geometry.kind, TwoViewKind::kGeneral);
  EXPECT_GT(count_true(geometry.inliers), 500U);
  EXPECT_LT(geometry.inliers.size() - count_true(geometry.inliers), 6U);
}

TEST(PairMatching, FindsRepeatedTextureThatComparingEverythingRefuses) {
  const SyntheticPair pair = make_pair({.true_count = 600});
  // The first 400 keypoints are unique; each of the others looks like one of them.
  FeatureSet first = describe(600, 400, 1);
  FeatureSet second = describe(600, 400, 1);
  const MatchableImage a = matchable(first, pair.first, pair);
  const MatchableImage b = matchable(second, pair.second, pair);
  const std::size_t everything = count_true(match_descriptors(a.index, b.index, {}));
  PairMatchingOptions options;
  options.coarse_features = 400;
  const TwoViewGeometry geometry = match_pair(a, b, options);
  EXPECT_GT(count_true(geometry.inliers), everything + 200);
}

TEST(PairMatching, ComparesAllFeaturesWhenTheCoarseOnesHaveNoGeometry) {
  // The first 40 keypoints look right but stand anywhere: matches without geometry.
  SyntheticPair pair = make_pair({.true_count = 340});
  Random random(4);
  for (std::size_t i = 0; i < 40; ++i) {
    pair.second[i] = {random.uniform(0.0, SyntheticPair::kWidth - 1.0),
                      random.uniform(0.0, SyntheticPair::kHeight - 1.0)};
  }
  const FeatureSet first = describe(340, 340, 1);
  const FeatureSet second = describe(340, 340, 1);
  const MatchableImage a = matchable(first, pair.first, pair);
  const MatchableImage b = matchable(second, pair.second, pair);
  PairMatchingOptions options;
  options.coarse_features = 40;
  EXPECT_EQ(match_pair(a, b, options).kind, TwoViewKind::kGeneral);
  options.min_matches_for_all = 1000;
  EXPECT_EQ(match_pair(a, b, options).kind, TwoViewKind::kNone);
}

TEST(PairMatching, UnrelatedImagesHaveNoGeometry) {
  const SyntheticPair pair = make_pair({.true_count = 400});
  const FeatureSet first = describe(400, 400, 1);
  const FeatureSet second = describe(400, 400, 2);
  const TwoViewGeometry geometry =
      match_pair(matchable(first, pair.first, pair), matchable(second, pair.second, pair), {});
  EXPECT_EQ(geometry.kind, TwoViewKind::kNone);
  EXPECT_TRUE(geometry.inliers.empty());
}

TEST(PairMatching, ImagesWithoutFeaturesHaveNoGeometry) {
  const SyntheticPair pair = make_pair({.true_count = 50});
  const FeatureSet none = describe(0, 1, 1);
  const MatchableImage empty = matchable(none, {}, pair);
  EXPECT_EQ(match_pair(empty, empty, {}).kind, TwoViewKind::kNone);
}

}  // namespace
}  // namespace trigmesh
