#pragma once

#include <cstddef>
#include <functional>

namespace trigmesh {

/// Thrown by an Executor that was asked to stop, through the algorithm that uses it, to whoever
/// made the executor; nobody else catches it. The one exception that steers: a stop token in every
/// signature of sfm would be the alternative, and none of its functions could do more with it than
/// return. Not a std::exception, so that adapters of libraries let it pass.
struct WorkStopped {};

/// Runs independent pieces of work, perhaps on several threads. Libraries that can use more than
/// one core take an Executor instead of starting threads. Results must not depend on the order or
/// the thread of the calls: each index writes only its own slot.
class Executor {
 public:
  Executor() = default;
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  Executor(Executor&&) = delete;
  Executor& operator=(Executor&&) = delete;
  virtual ~Executor() = default;

  /// Calls `work(i)` once for each i in [0, count) and returns when all calls have returned. Throws
  /// WorkStopped, when all calls that were begun have returned, if it was asked to stop before the
  /// last was begun.
  virtual void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) = 0;

  /// For long work that is not split: throws WorkStopped if it was asked to stop. Cheap, but no
  /// atom of an inner loop.
  virtual void stop_point() {}
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
