#include "firmware/pipeline/worker_pool.hpp"

#include <utility>

#include <pthread.h>
#include <signal.h>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

// Signals go to the main thread only: workers are started with all of them blocked.
class BlockedSignals {
 public:
  BlockedSignals() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }

  ~BlockedSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

  BlockedSignals(const BlockedSignals&) = delete;
  BlockedSignals& operator=(const BlockedSignals&) = delete;
  BlockedSignals(BlockedSignals&&) = delete;
  BlockedSignals& operator=(BlockedSignals&&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace

WorkerPool::WorkerPool(int num_threads, std::stop_token stop, ProgressListener* listener)
    : stop_(std::move(stop)), listener_(listener) {
  TM_CHECK(num_threads >= 1);
  const BlockedSignals blocked;
  for (int i = 1; i < num_threads; ++i) {
    threads_.emplace_back([this](const std::stop_token& end) { serve(end); });
    pthread_setname_np(threads_.back().native_handle(), "tm-worker");
  }
}

WorkerPool::~WorkerPool() {
  for (std::jthread& thread : threads_) {
    thread.request_stop();
  }
}

void WorkerPool::for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) {
  {
    const std::lock_guard lock(mutex_);
    work_ = &work;
    count_ = count;
    next_.store(0, std::memory_order_relaxed);
    ++job_number_;
  }
  job_changed_.notify_all();
  drain();
  std::unique_lock lock(mutex_);
  job_changed_.wait(lock, [this] { return busy_count_ == 0; });
  work_ = nullptr;
  lock.unlock();
  if (next_.load(std::memory_order_relaxed) < count) {
    throw WorkStopped{};
  }
  if (listener_ != nullptr) {
    listener_->on_work();
  }
}

void WorkerPool::stop_point() {
  if (stop_.stop_requested()) {
    throw WorkStopped{};
  }
}

void WorkerPool::serve(const std::stop_token& stop) {
  std::uint64_t seen = 0;
  std::unique_lock lock(mutex_);
  while (job_changed_.wait(lock, stop, [&] { return work_ != nullptr && job_number_ != seen; })) {
    seen = job_number_;
    ++busy_count_;
    lock.unlock();
    drain();
    lock.lock();
    --busy_count_;
    job_changed_.notify_all();
  }
}

void WorkerPool::drain() {
  while (!stop_.stop_requested()) {
    const std::size_t i = next_.fetch_add(1);
    if (i >= count_) {
      return;
    }
    (*work_)(i);
  }
}

}  // namespace trigmesh
