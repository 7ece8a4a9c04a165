#pragma once

#include <chrono>

#include "firmware/base/clock.hpp"

namespace trigmesh::test_support {

/// Time goes on when the test says so.
class ManualClock final : public Clock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const override { return now_; }

  void set(std::chrono::nanoseconds now) { now_ = now; }

 private:
  std::chrono::nanoseconds now_{};
};

/// The same for the time of day.
class ManualWallClock final : public WallClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const override { return now_; }

  void set(std::chrono::nanoseconds now) { now_ = now; }

 private:
  std::chrono::nanoseconds now_{};
};

}  // namespace trigmesh::test_support
