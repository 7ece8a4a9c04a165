#include "firmware/pipeline/worker_pool.hpp"

#include <atomic>
#include <numeric>
#include <stop_token>
#include <thread>
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

TEST_P(WorkerPoolThreads, EndsAJobBeforeItsNextIndexWhenAskedToStop) {
  std::stop_source stop;
  WorkerPool pool(GetParam(), stop.get_token());
  pool.stop_point();
  std::atomic<int> calls = 0;
  const auto work = [&](std::size_t i) {
    ++calls;
    if (i == 0) {
      stop.request_stop();
    }
    while (!stop.stop_requested()) {  // the others begin no second index
      std::this_thread::yield();
    }
  };
  EXPECT_THROW(pool.for_each_index(1000, work), WorkStopped);
  EXPECT_LE(calls, GetParam());
  EXPECT_THROW(pool.for_each_index(1, work), WorkStopped);
  EXPECT_THROW(pool.stop_point(), WorkStopped);
}

TEST_P(WorkerPoolThreads, GivesAJobThatWasCompleteWhenTheStopCame) {
  std::stop_source stop;
  WorkerPool pool(GetParam(), stop.get_token());
  pool.for_each_index(1, [&](std::size_t) { stop.request_stop(); });
}

class CountingListener final : public ProgressListener {
 public:
  void on_progress(const Progress& /*progress*/) override {}

  void on_work() override { ++finished; }

  int finished = 0;
};

TEST_P(WorkerPoolThreads, TellsOfEveryFinishedJob) {
  CountingListener listener;
  WorkerPool pool(GetParam(), {}, &listener);
  for (int job = 0; job < 10; ++job) {
    pool.for_each_index(5, [](std::size_t) {});
  }
  EXPECT_EQ(listener.finished, 10);
}

TEST(WorkerPool, EndsWithoutEverHavingWorked) {
  const WorkerPool pool(4);
}

}  // namespace
}  // namespace trigmesh
