#pragma once

#include <cstddef>
#include <functional>

namespace trigmesh {

/// Runs independent pieces of work, perhaps on several threads. Libraries that can use more than one core take
/// an Executor instead of starting threads. Results must not depend on the order or the thread of the calls:
/// each index writes only its own slot.
class Executor {
 public:
  Executor() = default;
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  Executor(Executor&&) = delete;
  Executor& operator=(Executor&&) = delete;
  virtual ~Executor() = default;

  /// Calls `work(i)` once for each i in [0, count) and returns when all calls have returned.
  virtual void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) = 0;
};

/// Runs everything in the calling thread, in order.
class SerialExecutor final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    for (std::size_t i = 0; i < count; ++i) {
      work(i);
    }
  }
};

}  // namespace trigmesh
