#include "sfm/geometry/sampling.hpp"

#include <array>
#include <set>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(RandomGenerator, SameSeedGivesTheSameNumbers) {
  RandomGenerator a(42);
  RandomGenerator b(42);
  RandomGenerator c(43);
  int equal_to_c = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t value = a.next();
    EXPECT_EQ(value, b.next());
    equal_to_c += value == c.next() ? 1 : 0;
  }
  EXPECT_LT(equal_to_c, 3);
}

TEST(RandomGenerator, BoundedNumbersAreEvenlySpread) {
  RandomGenerator random(1);
  std::array<int, 7> histogram{};
  for (int i = 0; i < 70000; ++i) {
    ++histogram.at(random.below(7));
  }
  for (const int count : histogram) {
    EXPECT_NEAR(count, 10000, 500);  // five standard deviations
  }
}

TEST(RandomGenerator, UniformStaysInItsInterval) {
  RandomGenerator random(5);
  double sum = 0.0;
  for (int i = 0; i < 10000; ++i) {
    const double value = random.uniform();
    ASSERT_GE(value, 0.0);
    ASSERT_LT(value, 1.0);
    sum += value;
  }
  EXPECT_NEAR(sum / 10000.0, 0.5, 0.015);
}

TEST(SampleDistinct, DrawsEverySubsetWithoutRepetition) {
  RandomGenerator random(9);
  std::set<std::set<std::uint32_t>> subsets;
  for (int i = 0; i < 500; ++i) {
    const auto sample = sample_distinct<3>(random, 5);
    const std::set<std::uint32_t> subset(sample.begin(), sample.end());
    ASSERT_EQ(subset.size(), 3U);
    ASSERT_LT(*subset.rbegin(), 5U);
    subsets.insert(subset);
  }
  EXPECT_EQ(subsets.size(), 10U);
}

TEST(SampleDistinct, DrawsAllWhenThereAreJustEnough) {
  RandomGenerator random(2);
  const auto sample = sample_distinct<4>(random, 4);
  EXPECT_EQ(std::set<std::uint32_t>(sample.begin(), sample.end()).size(), 4U);
}

TEST(RandomPermutation, HoldsEveryNumberOnce) {
  RandomGenerator random(3);
  const auto order = random_permutation(random, 100);
  EXPECT_EQ(std::set<std::uint32_t>(order.begin(), order.end()).size(), 100U);
  EXPECT_EQ(*std::max_element(order.begin(), order.end()), 99U);
  EXPECT_FALSE(std::is_sorted(order.begin(), order.end()));
  EXPECT_TRUE(random_permutation(random, 0).empty());
}

TEST(RequiredIterations, FollowsTheFormulaAndItsLimits) {
  EXPECT_EQ(required_iterations(0.5, 3, 0.99, 100000), 35U);  // log .01 / log .875 = 34.49
  EXPECT_EQ(required_iterations(1.0, 5, 0.99, 100), 1U);
  EXPECT_EQ(required_iterations(0.0, 5, 0.99, 100), 100U);
  EXPECT_EQ(required_iterations(0.01, 5, 0.99, 5000), 5000U);
}

}  // namespace
}  // namespace trigmesh
