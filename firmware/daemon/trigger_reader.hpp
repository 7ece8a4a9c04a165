#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>

#include "drivers/trigger/trigger_source.hpp"
#include "firmware/base/clock.hpp"
#include "firmware/daemon/heartbeat.hpp"
#include "firmware/daemon/logging.hpp"
#include "firmware/daemon/retries.hpp"
#include "firmware/daemon/rig_inputs.hpp"

namespace trigmesh {

/// What the thread works with; all of it outlives it.
struct TriggerParts {
  TriggerSource& source;
  RigQueue& rig;
  Faults& faults;
  Heartbeat& heartbeat;
  const Clock& clock;
};

/// Hands every edge of the button on to the rig; waits rather than drop one. A line that fails is
/// opened again by the table of fault_policy; commands work meanwhile. Single thread: run() is the
/// thread.
class TriggerReader {
 public:
  explicit TriggerReader(const TriggerParts& parts) : parts_(parts) {}

  void run(const std::stop_token& stop);

 private:
  /// Until a fault ends it; the fault, or nothing when there are no more edges.
  [[nodiscard]] std::optional<DeviceFault> read_edges(const std::stop_token& stop);
  void wait_to_retry(const std::stop_token& stop, std::chrono::nanoseconds delay);

  TriggerParts parts_;
  Retries retries_;
};

}  // namespace trigmesh
