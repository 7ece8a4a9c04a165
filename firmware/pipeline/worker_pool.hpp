#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/pipeline/progress.hpp"

namespace trigmesh {

/// Runs the indices of one job at a time on a fixed number of named threads; the calling thread is
/// one of them. Indices are handed out in ascending order, so a job whose early indices matter most
/// gets them first. Single owner: `for_each_index` is called from one thread at a time and not from
/// within its own work. A stop request ends a job before its next index, by WorkStopped.
class WorkerPool final : public Executor {
 public:
  /// `num_threads` >= 1, including the caller's. `listener`, which may be null and outlives the
  /// pool, is told of every finished job.
  explicit WorkerPool(int num_threads,
                      std::stop_token stop = {},
                      ProgressListener* listener = nullptr);
  ~WorkerPool() override;
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  WorkerPool(WorkerPool&&) = delete;
  WorkerPool& operator=(WorkerPool&&) = delete;

  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override;

  void stop_point() override;

 private:
  void serve(const std::stop_token& stop);
  void drain();

  const std::stop_token stop_;
  ProgressListener* const listener_;
  std::mutex mutex_;
  std::condition_variable_any job_changed_;
  const std::function<void(std::size_t)>* work_ =
      nullptr;                    // guarded by mutex_; set while a job runs
  std::uint64_t job_number_ = 0;  // guarded by mutex_
  std::size_t busy_count_ = 0;    // guarded by mutex_: threads inside drain()
  std::size_t count_ = 0;         // written before a job starts
  std::atomic<std::size_t> next_{0};
  std::vector<std::jthread> threads_;
};

}  // namespace trigmesh
