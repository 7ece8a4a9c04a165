#include "firmware/pipeline/worker_pool.hpp"

#include <atomic>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

class WorkerPoolThreads : public ::testing::TestWithParam<int> {};

TEST_P(WorkerPoolThreads, CallsEveryIndexOnce) {
  WorkerPool pool(GetParam());
  std::vector<std::atomic<int>> calls(1000);
  pool.for_each_index(calls.size(), [&](std::size_t i) { ++calls[i]; });
  for (const std::atomic<int>& count : calls) {
    EXPECT_EQ(count, 1);
  }
}

TEST_P(WorkerPoolThreads, ReturnsOnlyWhenAllWorkIsDone) {
  WorkerPool pool(GetParam());
  for (int job = 0; job < 500; ++job) {
    std::vector<int> results(7, 0);
    pool.for_each_index(results.size(), [&](std::size_t i) { results[i] = job; });
    ASSERT_EQ(std::accumulate(results.begin(), results.end(), 0), 7 * job);
  }
}

TEST_P(WorkerPoolThreads, DoesNothingForNoWork) {
  WorkerPool pool(GetParam());
  pool.for_each_index(0, [](std::size_t) { FAIL() << "there is no index to call"; });
}

INSTANTIATE_TEST_SUITE_P(OneToEight, WorkerPoolThreads, ::testing::Values(1, 2, 3, 8));

TEST(WorkerPool, EndsWithoutEverHavingWorked) {
  const WorkerPool pool(4);
}

}  // namespace
}  // namespace trigmesh
