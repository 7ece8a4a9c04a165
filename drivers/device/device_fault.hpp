#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/core.h>
#include <tl/expected.hpp>

#include "firmware/base/check.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// All that can go wrong with a device. The list is closed: a backend that meets something new maps
/// it to one of these, and the message keeps the system's words.
enum class FaultKind : std::uint8_t {
  kNotFound,        ///< no device of that name, now
  kPermission,      ///< it is there and may not be opened
  kBusy,            ///< another program has it
  kFormatRefused,   ///< it has no picture format or rate that we can use
  kControlRefused,  ///< it did not take a value, or did not keep it
  kNoSignal,        ///< it works and has nothing to show
  kTimeout,         ///< nothing came in the time given; the device may be well
  kGap,             ///< frames or edges are missing before this one: their number is counted
  kCorruptFrame,    ///< this frame is damaged, or its file unreadable; the next one may be whole
  kShortFrame,      ///< this frame has fewer bytes than its size needs
  kDisconnected,    ///< it is gone: unplugged, unbound
  kIo,              ///< the driver gave up for a reason that it does not tell
  kNotStarted,      ///< used before start() or after a fault that ended it
};

inline constexpr std::size_t kFaultKindCount = 13;

/// "not found", "no signal", ...: for messages and journals; stable.
[[nodiscard]] std::string_view to_string(FaultKind kind);

/// A fault of a device: what was attempted, on what, and why it failed; lower-case start, no final
/// period.
struct DeviceFault {
  FaultKind kind = FaultKind::kIo;
  std::string message;
};

/// The return type of what a device can refuse.
template <typename T = void>
using DeviceResult = tl::expected<T, DeviceFault>;

/// `return device_fault(FaultKind::kBusy, "cannot open {}: ...", path);`
template <typename... Args>
[[nodiscard]] tl::unexpected<DeviceFault> device_fault(FaultKind kind,
                                                       fmt::format_string<Args...> text,
                                                       Args&&... args) {
  return tl::unexpected<DeviceFault>(
      DeviceFault{kind, fmt::format(text, std::forward<Args>(args)...)});
}

/// What a failed system call on a device means. `attempt` reads "cannot open", `device` names what
/// was attempted on; `error_number` is an errno. Numbers that are not told apart are kIo.
[[nodiscard]] DeviceFault fault_of_errno(int error_number,
                                         std::string_view attempt,
                                         std::string_view device);

/// The fault as an Error of the program, its message untouched.
[[nodiscard]] Error to_error(const DeviceFault& fault);

/// What the owner of a device does after a fault.
enum class FaultAction : std::uint8_t {
  kContinue,  ///< wait again; nothing ended
  kRestart,   ///< stop(), start()
  kReopen,    ///< stop(), then start() until the device is back
  kGiveUp,    ///< a person has to act: settings, permission, cable
};

/// How often and how fast. Delays double from `first_delay` to `longest_delay`.
struct FaultPolicy {
  FaultAction action = FaultAction::kGiveUp;
  std::chrono::milliseconds first_delay{0};
  std::chrono::milliseconds longest_delay{0};
  /// Tries in a row after which to give up; 0: never give up.
  int max_tries = 0;
};

/// The one table of what to do about each fault.
[[nodiscard]] FaultPolicy fault_policy(FaultKind kind);

/// Number of faults of each kind. Thread-compatible.
class FaultCounters {
 public:
  void add(FaultKind kind, std::uint64_t count = 1) {
    counts_[static_cast<std::size_t>(kind)] += count;
  }

  [[nodiscard]] std::uint64_t of(FaultKind kind) const {
    return counts_[static_cast<std::size_t>(kind)];
  }

 private:
  std::array<std::uint64_t, kFaultKindCount> counts_{};
};

}  // namespace trigmesh

/// Returns the fault of a DeviceResult<void> expression from the enclosing function.
#define TM_RETURN_IF_FAULT(expression)                                                       \
  do {                                                                                       \
    auto tm_device_result = (expression);                                                    \
    if (!tm_device_result) {                                                                 \
      return ::tl::unexpected<::trigmesh::DeviceFault>(std::move(tm_device_result).error()); \
    }                                                                                        \
  } while (false)

#define TM_ASSIGN_OR_FAULT_INNER(result, declaration, expression)                \
  auto result = (expression);                                                    \
  if (!result) {                                                                 \
    return ::tl::unexpected<::trigmesh::DeviceFault>(std::move(result).error()); \
  }                                                                              \
  declaration = std::move(result).value()

/// `TM_ASSIGN_OR_FAULT(const int fd, open_device(path));` binds the value or returns the fault.
#define TM_ASSIGN_OR_FAULT(declaration, expression) \
  TM_ASSIGN_OR_FAULT_INNER(TM_CONCAT(tm_device_result_, __LINE__), declaration, expression)
