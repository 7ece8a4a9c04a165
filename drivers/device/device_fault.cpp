#include "drivers/device/device_fault.hpp"

#include <cerrno>
#include <system_error>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;

FaultKind kind_of_errno(int error_number) {
  switch (error_number) {
    case ENODEV:
    case ENXIO:
    case ESHUTDOWN:
      return FaultKind::kDisconnected;
    case ENOENT:
    case ENOTDIR:
      return FaultKind::kNotFound;
    case EACCES:
    case EPERM:
      return FaultKind::kPermission;
    case EBUSY:
      return FaultKind::kBusy;
    case ENOLINK:
    case ENOLCK:
      return FaultKind::kNoSignal;
    case ETIMEDOUT:
      return FaultKind::kTimeout;
    default:
      return FaultKind::kIo;
  }
}

ErrorCode code_of(FaultKind kind) {
  switch (kind) {
    case FaultKind::kNotFound:
      return ErrorCode::kNotFound;
    case FaultKind::kFormatRefused:
    case FaultKind::kControlRefused:
      return ErrorCode::kUnsupported;
    case FaultKind::kCorruptFrame:
    case FaultKind::kShortFrame:
      return ErrorCode::kCorruptData;
    default:
      return ErrorCode::kIo;
  }
}

}  // namespace

std::string_view to_string(FaultKind kind) {
  constexpr std::array<std::string_view, kFaultKindCount> kNames = {
      "not found",
      "permission denied",
      "busy",
      "format refused",
      "control refused",
      "no signal",
      "timeout",
      "gap",
      "corrupt frame",
      "short frame",
      "disconnected",
      "input/output error",
      "not started",
  };
  return kNames[static_cast<std::size_t>(kind)];
}

DeviceFault fault_of_errno(int error_number, std::string_view attempt, std::string_view device) {
  return {kind_of_errno(error_number),
          fmt::format("{} {}: {}", attempt, device, std::generic_category().message(error_number))};
}

Error to_error(const DeviceFault& fault) {
  return {code_of(fault.kind), fault.message};
}

FaultPolicy fault_policy(FaultKind kind) {
  switch (kind) {
    case FaultKind::kGap:
    case FaultKind::kCorruptFrame:
    case FaultKind::kShortFrame:
      return {FaultAction::kContinue, milliseconds(0), milliseconds(0), 0};
    // Waiting again is what a first time-out asks for; a camera that stays silent is restarted.
    case FaultKind::kTimeout:
    case FaultKind::kIo:
      return {FaultAction::kRestart, milliseconds(100), milliseconds(5000), 8};
    // A cable that is out may come back in an hour: the rig waits, and its light says so.
    case FaultKind::kNotFound:
    case FaultKind::kDisconnected:
      return {FaultAction::kReopen, milliseconds(250), milliseconds(2000), 0};
    case FaultKind::kBusy:
    case FaultKind::kNoSignal:
      return {FaultAction::kReopen, milliseconds(500), milliseconds(5000), 0};
    // udev sets the rights of a device that was just plugged in a moment after it appears.
    case FaultKind::kPermission:
      return {FaultAction::kReopen, milliseconds(250), milliseconds(1000), 5};
    case FaultKind::kFormatRefused:
    case FaultKind::kControlRefused:
    case FaultKind::kNotStarted:
      break;
  }
  return {};
}

}  // namespace trigmesh
