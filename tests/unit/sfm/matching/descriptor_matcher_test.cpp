#include "sfm/matching/descriptor_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/matching/instruction_sets.hpp"

namespace trigmesh {
namespace {

using test_support::for_each_instruction_set;

FeatureSet empty_set(FeatureKind kind, std::size_t bytes) {
  FeatureSet set;
  set.kind = kind;
  set.descriptor_bytes = bytes;
  return set;
}

void append(FeatureSet& set, const std::vector<std::uint8_t>& descriptor) {
  set.keypoints.emplace_back();
  set.descriptors.insert(set.descriptors.end(), descriptor.begin(), descriptor.end());
}

std::vector<std::uint8_t> random_bytes(std::size_t bytes, int largest, std::mt19937& random) {
  std::vector<std::uint8_t> out(bytes);
  for (auto& byte : out) {
    byte = static_cast<std::uint8_t>(random() % static_cast<unsigned>(largest + 1));
  }
  return out;
}

/// Like SIFT: sparse, of length about `length`.
std::vector<std::uint8_t> random_vector(std::size_t bytes, double length, std::mt19937& random) {
  std::exponential_distribution<double> component(1.0);
  std::vector<double> values(bytes);
  double squared = 0.0;
  for (auto& value : values) {
    value = component(random);
    squared += value * value;
  }
  std::vector<std::uint8_t> out(bytes);
  for (std::size_t i = 0; i < bytes; ++i) {
    out[i] = static_cast<std::uint8_t>(
        std::min(127.0, std::round(values[i] * length / std::sqrt(squared))));
  }
  return out;
}

std::vector<std::uint8_t> disturbed(std::vector<std::uint8_t> descriptor,
                                    int amount,
                                    int largest,
                                    std::mt19937& random) {
  for (auto& byte : descriptor) {
    const int change = static_cast<int>(random() % static_cast<unsigned>(2 * amount + 1)) - amount;
    byte = static_cast<std::uint8_t>(std::clamp(byte + change, 0, largest));
  }
  return descriptor;
}

std::int64_t slow_similarity(const FeatureSet& a,
                             std::size_t i,
                             const FeatureSet& b,
                             std::size_t j) {
  const auto x = a.descriptor(i);
  const auto y = b.descriptor(j);
  std::int64_t sum = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (descriptor_metric(a.kind) == DescriptorMetric::kDotProduct) {
      sum += std::int64_t{x[k]} * y[k];
    } else {
      for (int bit = 0; bit < 8; ++bit) {
        sum += ((x[k] >> bit) & 1) == ((y[k] >> bit) & 1) ? 1 : 0;
      }
    }
  }
  return sum;
}

struct SlowNearest {
  std::int64_t best = 0;
  std::int64_t second = 0;
  std::size_t position = 0;
};

SlowNearest slow_nearest(const FeatureSet& a,
                         std::size_t i,
                         const FeatureSet& b,
                         std::size_t count_b) {
  SlowNearest out;
  for (std::size_t j = 0; j < count_b; ++j) {
    const std::int64_t score = slow_similarity(a, i, b, j);
    if (score > out.best) {
      out = {score, out.best, j};
    } else {
      out.second = std::max(out.second, score);
    }
  }
  return out;
}

/// The definition, in the order in which it is written down.
std::vector<FeatureMatch> slow_match(const FeatureSet& a,
                                     const FeatureSet& b,
                                     const MatchOptions& options) {
  const std::size_t count_a = std::min(a.size(), options.max_features);
  const std::size_t count_b = std::min(b.size(), options.max_features);
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < count_a; ++i) {
    const SlowNearest in_b = slow_nearest(a, i, b, count_b);
    if (in_b.best == 0) {
      continue;
    }
    const SlowNearest in_a = slow_nearest(b, in_b.position, a, count_a);
    if (in_a.position != i) {
      continue;
    }
    double best = 0.0;
    double second_in_b = 0.0;
    double second_in_a = 0.0;
    if (descriptor_metric(a.kind) == DescriptorMetric::kDotProduct) {
      const double scale =
          std::sqrt(static_cast<double>(slow_similarity(a, i, a, i))) *
          std::sqrt(static_cast<double>(slow_similarity(b, in_b.position, b, in_b.position)));
      const auto distance = [&](std::int64_t dot) {
        return std::sqrt(2.0 - 2.0 * static_cast<double>(dot) / scale);
      };
      best = in_b.best == in_b.second ? 1.0 : distance(in_b.best);
      second_in_b = in_b.best == in_b.second ? 1.0 : distance(in_b.second);
      second_in_a = distance(in_a.second);
    } else {
      const auto bits = static_cast<std::int64_t>(8 * a.descriptor_bytes);
      best = static_cast<double>(bits - in_b.best);
      second_in_b = static_cast<double>(bits - in_b.second);
      second_in_a = static_cast<double>(bits - in_a.second);
    }
    if (best < options.max_ratio * second_in_b && best < options.max_ratio * second_in_a) {
      matches.push_back({id_of<FeatureIndex>(i), id_of<FeatureIndex>(in_b.position)});
    }
  }
  return matches;
}

std::vector<FeatureMatch> fast_match(const FeatureSet& a,
                                     const FeatureSet& b,
                                     const MatchOptions& options) {
  const auto index_a = DescriptorIndex::build(a);
  const auto index_b = DescriptorIndex::build(b);
  EXPECT_TRUE(index_a.has_value());
  EXPECT_TRUE(index_b.has_value());
  return match_descriptors(*index_a, *index_b, options);
}

struct Kind {
  FeatureKind kind;
  std::size_t bytes;
  int largest;
};

/// Two sets of which about half of the smaller have a disturbed twin in the other.
std::pair<FeatureSet, FeatureSet> related_sets(const Kind& kind,
                                               std::size_t count_a,
                                               std::size_t count_b,
                                               unsigned seed) {
  std::mt19937 random(seed);
  FeatureSet a = empty_set(kind.kind, kind.bytes);
  FeatureSet b = empty_set(kind.kind, kind.bytes);
  const bool dot = descriptor_metric(kind.kind) == DescriptorMetric::kDotProduct;
  const auto fresh = [&] {
    return dot ? random_vector(kind.bytes, 256.0, random) : random_bytes(kind.bytes, 255, random);
  };
  for (std::size_t i = 0; i < count_a; ++i) {
    append(a, fresh());
  }
  for (std::size_t j = 0; j < count_b; ++j) {
    if (j % 2 == 0 && count_a > 0) {
      const auto twin = a.descriptor((j * 7) % count_a);
      append(b, disturbed({twin.begin(), twin.end()}, dot ? 6 : 3, kind.largest, random));
    } else {
      append(b, fresh());
    }
  }
  return {std::move(a), std::move(b)};
}

class DescriptorMatcher : public testing::TestWithParam<Kind> {};

TEST_P(DescriptorMatcher, AgreesWithTheDefinitionForAllSizesAndInstructionSets) {
  std::size_t found = 0;
  for_each_instruction_set([&] {
    for (const auto& [count_a, count_b] :
         std::vector<std::pair<std::size_t, std::size_t>>{{0, 0},
                                                          {0, 5},
                                                          {5, 0},
                                                          {1, 1},
                                                          {1, 2},
                                                          {2, 1},
                                                          {3, 4},
                                                          {7, 15},
                                                          {16, 17},
                                                          {31, 33},
                                                          {65, 64},
                                                          {130, 97}}) {
      SCOPED_TRACE(std::to_string(count_a) + " x " + std::to_string(count_b));
      const auto [a, b] = related_sets(GetParam(), count_a, count_b, 11);
      const auto matches = fast_match(a, b, {});
      EXPECT_EQ(matches, slow_match(a, b, {}));
      found += matches.size();
    }
  });
  EXPECT_GT(found, 50U);
}

TEST_P(DescriptorMatcher, ComparesOnlyTheFirstFeaturesWhenAsked) {
  const auto [a, b] = related_sets(GetParam(), 150, 140, 12);
  for_each_instruction_set([&, &first = a, &second = b] {
    for (const std::size_t count : {0U, 1U, 5U, 40U, 77U, 1000U}) {
      SCOPED_TRACE(count);
      const MatchOptions options{.max_features = count};
      EXPECT_EQ(fast_match(first, second, options), slow_match(first, second, options));
    }
  });
}

TEST_P(DescriptorMatcher, PrefersTheLowestIndexAmongEquals) {
  // Coarse values make ties frequent; ratio 1 lets near-ties through.
  std::mt19937 random(5);
  FeatureSet a = empty_set(GetParam().kind, GetParam().bytes);
  FeatureSet b = a;
  for (int i = 0; i < 120; ++i) {
    append(a, random_bytes(GetParam().bytes, 1, random));
    append(b, random_bytes(GetParam().bytes, 1, random));
  }
  const MatchOptions options{.max_ratio = 1.0};
  for_each_instruction_set(
      [&] { EXPECT_EQ(fast_match(a, b, options), slow_match(a, b, options)); });
}

TEST_P(DescriptorMatcher, RejectsWhatOccursTwice) {
  std::mt19937 random(6);
  FeatureSet a = empty_set(GetParam().kind, GetParam().bytes);
  FeatureSet b = a;
  const auto twice = random_vector(GetParam().bytes, 256.0, random);
  const auto once = random_vector(GetParam().bytes, 256.0, random);
  append(a, twice);
  append(a, once);
  append(b, twice);
  append(b, twice);
  append(b, once);
  const MatchOptions options{.max_ratio = 1.0};
  const std::vector<FeatureMatch> expected{{FeatureIndex{1}, FeatureIndex{2}}};
  for_each_instruction_set([&] {
    EXPECT_EQ(fast_match(a, b, options), expected);
    const std::vector<FeatureMatch> mirrored{{FeatureIndex{2}, FeatureIndex{1}}};
    EXPECT_EQ(fast_match(b, a, options), mirrored);
  });
}

TEST_P(DescriptorMatcher, IsSymmetric) {
  const auto [a, b] = related_sets(GetParam(), 90, 110, 13);
  auto mirrored = fast_match(b, a, {});
  for (FeatureMatch& match : mirrored) {
    std::swap(match.first, match.second);
  }
  std::sort(mirrored.begin(), mirrored.end());
  EXPECT_EQ(fast_match(a, b, {}), mirrored);
}

INSTANTIATE_TEST_SUITE_P(Kinds,
                         DescriptorMatcher,
                         testing::Values(Kind{FeatureKind::kSift, 128, 127},
                                         Kind{FeatureKind::kSurf, 64, 127},
                                         Kind{FeatureKind::kSurf, 61, 127},
                                         Kind{FeatureKind::kOrb, 32, 255},
                                         Kind{FeatureKind::kAkaze, 64, 255},
                                         Kind{FeatureKind::kAkaze, 61, 255}),
                         [](const auto& instance) {
                           return std::string(to_string(instance.param.kind)) +
                                  std::to_string(instance.param.bytes);
                         });

TEST(DescriptorMatcherSaturation, LongVectorsAreComparedExactly) {
  // Dot products far above what 16 bits hold.
  for (const double length : {250.0, 262.0, 330.0, 900.0}) {
    SCOPED_TRACE(length);
    std::mt19937 random(7);
    FeatureSet a = empty_set(FeatureKind::kSift, 128);
    FeatureSet b = a;
    for (int i = 0; i < 60; ++i) {
      const auto descriptor = random_vector(128, length, random);
      append(a, descriptor);
      append(b, disturbed(descriptor, 4, 127, random));
    }
    for_each_instruction_set([&] {
      const auto matches = fast_match(a, b, {});
      EXPECT_EQ(matches, slow_match(a, b, {}));
      EXPECT_GT(matches.size(), 30U);
    });
  }
}

TEST(DescriptorMatcherSaturation, LargestBytesDoNotOverflow) {
  FeatureSet a = empty_set(FeatureKind::kSift, 128);
  FeatureSet b = a;
  append(a, std::vector<std::uint8_t>(128, 127));
  std::vector<std::uint8_t> near(128, 127);
  near[5] = 126;
  append(b, std::vector<std::uint8_t>(128, 40));
  append(b, near);
  const MatchOptions options{.max_ratio = 1.0};
  // By direction all three are alike: the test is that the larger of two huge dot products wins.
  for_each_instruction_set(
      [&] { EXPECT_EQ(fast_match(a, b, options), slow_match(a, b, options)); });
}

TEST(DescriptorMatcherRatio, AcceptsJustBelowAndRejectsAtTheLimit) {
  // Bits: nearest at distance 8, second at distance 10 (one direction decides: the other has no
  // rival).
  FeatureSet a = empty_set(FeatureKind::kOrb, 32);
  FeatureSet b = a;
  append(a, std::vector<std::uint8_t>(32, 0));
  std::vector<std::uint8_t> eight(32, 0);
  eight[3] = 0xFF;
  std::vector<std::uint8_t> ten(32, 0);
  ten[20] = 0xFF;
  ten[21] = 0x03;
  append(b, eight);
  append(b, ten);
  EXPECT_THAT(fast_match(a, b, {.max_ratio = 0.8}), testing::IsEmpty());
  EXPECT_THAT(fast_match(a, b, {.max_ratio = 0.81}), testing::SizeIs(1));
}

TEST(DescriptorMatcherRatio, OneCandidateIsComparedWithAnUnrelatedOne) {
  FeatureSet a = empty_set(FeatureKind::kSift, 128);
  FeatureSet near = a;
  FeatureSet far = a;
  std::vector<std::uint8_t> descriptor(128, 0);
  descriptor[0] = 100;
  append(a, descriptor);
  append(near, descriptor);
  descriptor[0] = 1;
  descriptor[1] = 100;
  append(far, descriptor);
  EXPECT_THAT(fast_match(a, near, {}), testing::SizeIs(1));
  EXPECT_THAT(fast_match(a, far, {}), testing::IsEmpty());
}

TEST(DescriptorMatcherRatio, ZeroDescriptorsMatchNothing) {
  FeatureSet a = empty_set(FeatureKind::kSift, 128);
  append(a, std::vector<std::uint8_t>(128, 0));
  append(a, std::vector<std::uint8_t>(128, 0));
  EXPECT_THAT(fast_match(a, a, {.max_ratio = 1.0}), testing::IsEmpty());
}

TEST(DescriptorIndex, RefusesSizesThatDoNotFit) {
  FeatureSet set = empty_set(FeatureKind::kSift, 128);
  append(set, std::vector<std::uint8_t>(127, 1));
  EXPECT_EQ(DescriptorIndex::build(set).error().code, ErrorCode::kInvalidArgument);
  set.descriptor_bytes = 0;
  EXPECT_EQ(DescriptorIndex::build(set).error().code, ErrorCode::kInvalidArgument);
  FeatureSet wide = empty_set(FeatureKind::kOrb, 513);
  append(wide, std::vector<std::uint8_t>(513, 1));
  EXPECT_EQ(DescriptorIndex::build(wide).error().code, ErrorCode::kInvalidArgument);
}

TEST(DescriptorIndex, RefusesDotProductBytesAbove127) {
  FeatureSet set = empty_set(FeatureKind::kSift, 128);
  append(set, std::vector<std::uint8_t>(128, 128));
  EXPECT_EQ(DescriptorIndex::build(set).error().code, ErrorCode::kInvalidArgument);
  set.kind = FeatureKind::kOrb;
  EXPECT_TRUE(DescriptorIndex::build(set).has_value());
}

TEST(MatchOptions, RefusesRatiosOutOfRange) {
  EXPECT_TRUE(MatchOptions{}.validate().has_value());
  EXPECT_FALSE(MatchOptions{.max_ratio = 0.0}.validate().has_value());
  EXPECT_FALSE(MatchOptions{.max_ratio = 1.01}.validate().has_value());
  EXPECT_FALSE(MatchOptions{.max_ratio = std::nan("")}.validate().has_value());
}

TEST(TwoViewKindNames, AreSnakeCase) {
  EXPECT_EQ(to_string(TwoViewKind::kPureRotation), "pure_rotation");
  EXPECT_EQ(to_string(TwoViewKind::kNone), "none");
  EXPECT_EQ(to_string(TwoViewKind::kGeneral), "general");
  EXPECT_EQ(to_string(TwoViewKind::kPlanar), "planar");
  EXPECT_EQ(to_string(TwoViewKind::kWatermark), "watermark");
  EXPECT_EQ(to_string(TwoViewKind::kDuplicate), "duplicate");
}

}  // namespace
}  // namespace trigmesh
