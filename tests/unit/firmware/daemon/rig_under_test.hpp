#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/indicator/mock/mock_indicator.hpp"
#include "drivers/trigger/command/command_trigger.hpp"
#include "firmware/control/event_log.hpp"
#include "firmware/daemon/daemon.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/firmware/daemon/live_camera.hpp"
#include "tests/unit/firmware/daemon/mock_model_maker.hpp"
#include "tests/unit/firmware/daemon/test_disk.hpp"

namespace trigmesh::test_support {

/// A rig with all its threads, a camera that runs, a disk and a button in the hands of the test.
class RigUnderTest : public ::testing::Test {
 protected:
  /// Long enough for a loaded machine with sanitizers.
  static constexpr std::chrono::seconds kPatience{40};

  RigUnderTest();

  ~RigUnderTest() override { end_daemon(); }

  /// With `options_` as they are now.
  void start_daemon();
  /// In order; checks that it comes to its end.
  void end_daemon();

  /// Threads are stopped, nothing is closed: as when the program is killed between two steps.
  void drop_daemon() {
    models_.lose();
    daemon_.reset();
  }

  void press_and_release();

  void press() { inject(TriggerAction::kPressed); }

  void release() { inject(TriggerAction::kReleased); }

  /// Waits for the next event of this kind whose data has `text` in it; events before it count as
  /// seen.
  void await(std::string_view kind, std::string_view text = "");

  /// Waits until `is_so` holds, looking again and again.
  template <typename Condition>
  void await_that(Condition is_so) {
    const auto limit = clock_.now() + kPatience;
    while (!is_so()) {
      ASSERT_LT(clock_.now(), limit) << "did not become true";
      (void)nothing_.wait_after(0, std::chrono::milliseconds(2));
    }
  }

  [[nodiscard]] ControlTarget& control() { return daemon_->target(); }

  [[nodiscard]] ControlStatus status() { return *control().status(); }

  [[nodiscard]] std::vector<SessionInfo> sessions() { return *control().sessions(); }

  /// What its journal tells.
  [[nodiscard]] std::vector<JournalRecord> journal_of(const std::string& id);
  [[nodiscard]] std::vector<FrameKept> kept_of(const std::string& id);
  /// A session as an earlier run of the program left it.
  [[nodiscard]] std::string leave_session(const std::vector<SessionState>& states,
                                          std::size_t frames = 1);

  const TemporaryFolder temporary_{folder_in_memory()};
  SteadyClock clock_;
  SystemWallClock wall_clock_;
  TestDisk disk_;
  ModelScript models_;
  std::shared_ptr<LiveCameraHand> camera_ = std::make_shared<LiveCameraHand>();
  DaemonOptions options_;
  std::unique_ptr<Daemon> daemon_;

 private:
  void inject(TriggerAction action);

  EventLog events_{100'000};
  EventLog nothing_{1};
  std::uint64_t seen_ = 0;
  CommandTrigger* button_ = nullptr;  ///< of the daemon
};

}  // namespace trigmesh::test_support
