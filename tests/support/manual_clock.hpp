#pragma once

#include <chrono>

#include "firmware/base/clock.hpp"

namespace trigmesh::test_support {

/// Stands still unless a test moves it.
class ManualClock final : public Clock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const override { return time; }

  std::chrono::nanoseconds time = std::chrono::seconds(100);
};

/// The same for the time of day.
class ManualWallClock final : public WallClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const override { return time; }

  std::chrono::nanoseconds time{};
};

}  // namespace trigmesh::test_support
