#include "firmware/pipeline/memory_plan.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

constexpr std::uint64_t kMegabyte = 1'000'000;

MemoryDemand photographs(int threads) {
  return {25, 1536 * 1024, threads};
}

TEST(MemoryPlan, ChangesNothingWithoutALimit) {
  const FeatureOptions wanted;
  const auto plan = plan_memory(photographs(2), wanted, 0);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->extraction_threads, 2);
  EXPECT_EQ(plan->features.max_keypoints, wanted.max_keypoints);
  EXPECT_TRUE(plan->lowered.empty());
}

TEST(MemoryPlan, GivesUpThreadsBeforeQuality) {
  const auto plan = plan_memory(photographs(8), {}, 1000 * kMegabyte);
  ASSERT_TRUE(plan);
  EXPECT_LT(plan->extraction_threads, 8);
  EXPECT_TRUE(plan->features.upsample);
  EXPECT_TRUE(plan->lowered.empty());
}

TEST(MemoryPlan, LowersQualityInDeclaredStepsAndSaysSo) {
  const auto small = plan_memory(photographs(2), {}, 400 * kMegabyte);
  ASSERT_TRUE(small);
  EXPECT_FALSE(small->features.upsample);
  EXPECT_EQ(small->features.max_keypoints, FeatureOptions{}.max_keypoints);
  EXPECT_EQ(small->lowered.size(), 1U);
  const auto smaller = plan_memory(photographs(2), {}, 280 * kMegabyte);
  ASSERT_TRUE(smaller);
  EXPECT_LT(smaller->features.max_keypoints, FeatureOptions{}.max_keypoints);
  EXPECT_EQ(smaller->lowered.size(), 2U);
}

TEST(MemoryPlan, HasTheSameQualityForEveryNumberOfThreads) {
  for (const std::uint64_t limit : {250U, 300U, 400U, 600U, 900U}) {
    const auto one = plan_memory(photographs(1), {}, limit * kMegabyte);
    const auto eight = plan_memory(photographs(8), {}, limit * kMegabyte);
    ASSERT_TRUE(one && eight) << limit;
    EXPECT_EQ(one->features.upsample, eight->features.upsample);
    EXPECT_EQ(one->features.max_keypoints, eight->features.max_keypoints);
    EXPECT_EQ(one->lowered, eight->lowered);
  }
}

TEST(MemoryPlan, RefusesALimitThatNothingFits) {
  const auto plan = plan_memory(photographs(1), {}, 50 * kMegabyte);
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, ErrorCode::kLimitExceeded);
}

}  // namespace
}  // namespace trigmesh
