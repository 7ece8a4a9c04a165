#pragma once

#include <stop_token>
#include <thread>

#include <signal.h>

namespace trigmesh {

/// Turns the first SIGINT or SIGTERM into a stop request; a second one ends the program at once.
/// Made in the main thread before other threads start: they inherit its blocked signals.
class InterruptWatch {
 public:
  InterruptWatch();
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;
  InterruptWatch(InterruptWatch&&) = delete;
  InterruptWatch& operator=(InterruptWatch&&) = delete;

  [[nodiscard]] std::stop_token token() const { return interrupted_.get_token(); }

 private:
  void wait();

  sigset_t signals_{};
  sigset_t mask_before_{};
  int signal_fd_ = -1;
  int end_fd_ = -1;
  std::stop_source interrupted_;
  std::jthread waiter_;
};

}  // namespace trigmesh
