#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>

#include "firmware/base/clock.hpp"
#include "firmware/base/file_system.hpp"
#include "firmware/control/control_target.hpp"
#include "firmware/daemon/logging.hpp"
#include "firmware/daemon/rig_inputs.hpp"
#include "firmware/daemon/status_board.hpp"
#include "firmware/daemon/storage_inbox.hpp"

namespace trigmesh {

/// What the adapter works with; all of it outlives it.
struct ControlParts {
  RigQueue& rig;
  StorageInbox& storage;
  const StatusBoard& status;
  const Faults& faults;
  FileSystem& files;
  const Clock& clock;
  std::function<void(std::string_view, const std::string&)> publish;
  std::function<Result<std::vector<DeviceInfo>>()> list_devices;
};

/// The rig as the control interface sees it: commands go through the rig's queue like presses, and
/// wait for what becomes of them. Thread-safe.
class ControlAdapter final : public ControlTarget {
 public:
  /// `patience`: how long a command may take, e.g. on a slow disk; longer is kIo. > 0.
  ControlAdapter(const ControlParts& parts, std::chrono::milliseconds patience)
      : parts_(parts), patience_(patience) {}

  [[nodiscard]] Result<ControlStatus> status() override;

  [[nodiscard]] Result<> start() override { return command(CommandKind::kStart); }

  [[nodiscard]] Result<> finish() override { return command(CommandKind::kFinish); }

  /// Returns when the frame is stored, or why there is none.
  [[nodiscard]] Result<> still() override { return command(CommandKind::kStill); }

  [[nodiscard]] Result<> undo() override { return command(CommandKind::kUndo); }

  [[nodiscard]] Result<> cancel_model() override { return command(CommandKind::kCancelModel); }

  [[nodiscard]] Result<> continue_session(const std::string& id) override;
  [[nodiscard]] Result<std::vector<SessionInfo>> sessions() override;
  [[nodiscard]] Result<> remove_session(const std::string& id) override;
  [[nodiscard]] Result<ExportReport> export_session(
      const std::string& id, const std::filesystem::path& destination) override;

  [[nodiscard]] Result<std::vector<DeviceInfo>> devices() override { return parts_.list_devices(); }

 private:
  [[nodiscard]] Result<> command(CommandKind kind);

  ControlParts parts_;
  std::chrono::milliseconds patience_;
};

}  // namespace trigmesh
