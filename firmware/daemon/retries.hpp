#pragma once

#include <chrono>

#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// When to try a device again after faults, by the table of fault_policy. Thread-compatible.
class Retries {
 public:
  /// After the table gives up, a device is still tried so often: a person may have mended it.
  static constexpr std::chrono::milliseconds kAfterGivingUp{30'000};

  /// One more fault in a row: how long to wait before the next try.
  [[nodiscard]] std::chrono::milliseconds delay_after(FaultKind kind);

  /// The device works again.
  void reset() { tries_ = 0; }

  [[nodiscard]] int tries() const { return tries_; }

 private:
  int tries_ = 0;
};

}  // namespace trigmesh
