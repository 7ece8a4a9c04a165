// The subcommands that talk to the service, as a user runs them, before a rig that is not there.

#include <atomic>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/control/control_events.hpp"
#include "tests/integration/fake_rig.hpp"
#include "tests/integration/run_program.hpp"

namespace trigmesh::test_support {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class RigCommands : public ScratchTest {
 protected:
  [[nodiscard]] ProgramResult run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--socket", socket_});
    return run_trigmesh(std::move(arguments));
  }

  [[nodiscard]] FakeRig& rig() { return served_.rig(); }

  void publish(std::string_view kind, const std::string& json) {
    served_.server().publish(std::string(kind), json);
  }

  /// The rig begins a session when it is asked to, and keeps frames from when it is looked at.
  void capture_when_started(std::uint32_t frames) {
    rig().on_command([this, frames](const std::string& what) {
      ControlStatus status;
      status.session_root = "/data";
      if (what == "start") {
        status.phase = RigPhase::kCapturing;
        status.session_id = kClosedSession;
        rig().on_status([this, frames] { keep_frames(frames); });
      }
      rig().set_status(status);
      publish(kPhaseEvent, render_phase_event(status.phase, status.session_id));
    });
  }

  /// The storage is done when somebody has looked once.
  void open_late() {
    rig().on_status([this] {
      ControlStatus status;
      status.phase = RigPhase::kCapturing;
      status.session_id = kClosedSession;
      rig().set_status(status);
      keep_frames(1);
    });
    publish(kPhaseEvent, render_phase_event(RigPhase::kCapturing, kClosedSession));
  }

  void keep_frames(std::uint32_t frames) {
    rig().on_status({});
    for (std::uint32_t i = 1; i <= frames; ++i) {
      publish(kFrameEvent, render_frame_event(kClosedSession, i));
    }
  }

  const std::string socket_ = path("control.sock");
  ServedRig served_{{.socket_path = socket_}};
};

TEST_F(RigCommands, StatusTellsWhatTheRigDoes) {
  ControlStatus status;
  status.phase = RigPhase::kWorking;
  status.camera_present = true;
  status.available_bytes = 12'300'000'000;
  status.job = JobState::kRunning;
  status.model_session_id = kReadySession;
  status.model_stage = "mapping";
  status.model_done = 3;
  status.model_total = 10;
  status.queued_models = 2;
  status.software_version = "1.2.3";
  rig().set_status(status);
  const ProgramResult result = run({"status"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out,
            fmt::format("rig       working, camera is there\n"
                        "session   none is open\n"
                        "model     of {}: running, mapping 3 of 10; 2 waiting\n"
                        "storage   ok, room for 12.3 GB\n"
                        "software  1.2.3\n",
                        kReadySession));
  status.fault = "the camera is gone; plug it in";
  rig().set_status(status);
  EXPECT_THAT(run({"status"}).out, HasSubstr("fault     the camera is gone; plug it in\n"));
  EXPECT_THAT(run({"status", "--json"}).out, AllOf(StartsWith("{"), EndsWith("}\n")));
}

TEST_F(RigCommands, TriggerPassesEveryCommandOn) {
  for (const char* what : {"start", "still", "undo", "finish", "cancel"}) {
    EXPECT_EQ(run({"trigger", what}).exit_code, 0);
  }
  EXPECT_THAT(rig().asked(), ElementsAre("start", "still", "undo", "finish", "cancel"));
  EXPECT_EQ(run({"trigger", "jump"}).exit_code, 2);
  EXPECT_EQ(run({"trigger"}).exit_code, 2);
}

TEST_F(RigCommands, ExitCodesTellWhatWentWrong) {
  rig().refuse_with(Error{ErrorCode::kNoSpace, "the disk is full"});
  const ProgramResult full = run({"trigger", "start"});
  EXPECT_EQ(full.exit_code, 6);
  EXPECT_EQ(full.err, "trigmesh: the disk is full\n");
  rig().refuse_with(Error{ErrorCode::kInsufficientData, "nothing is open"});
  EXPECT_EQ(run({"trigger", "finish"}).exit_code, 4);
}

TEST_F(RigCommands, SayThatTheServiceDoesNotRun) {
  served_.stop();
  for (const char* command : {"status", "sessions", "watch", "record"}) {
    const ProgramResult result = run({command});
    EXPECT_EQ(result.exit_code, 5) << command;
    EXPECT_THAT(result.err, HasSubstr("is trigmeshd running?")) << command;
  }
}

TEST_F(RigCommands, SessionsAreListedAndRemoved) {
  const ProgramResult list = run({"sessions"});
  EXPECT_EQ(list.exit_code, 0) << list.err;
  EXPECT_EQ(list.out,
            "ID                        STATE           FRAMES       SIZE  MODEL  EXPORTED\n"
            "20240229T235959Z-00ff00   model_ready         12    34.6 MB  yes    yes\n"
            "20240301T000000Z-00ff01   closed               0      999 B  no     no\n");
  EXPECT_THAT(run({"sessions", "--json"}).out, StartsWith("[{\"id\":"));
  EXPECT_EQ(run({"sessions", "remove", kClosedSession}).exit_code, 0);
  EXPECT_THAT(rig().asked(), ElementsAre(std::string("remove ") + kClosedSession));
  EXPECT_EQ(run({"sessions", "remove", "20240301T000000Z-000000"}).exit_code, 3);
  EXPECT_EQ(run({"sessions", "remove", "everything"}).exit_code, 2);
  EXPECT_EQ(run({"sessions", "remove"}).exit_code, 2);
}

TEST_F(RigCommands, DevicesComeFromTheServiceOrFromTheBoard) {
  EXPECT_EQ(run({"devices"}).out,
            "camera  usb-Example-video-index0\n    Example\n    /dev/video0\n"
            "gpio chip  gpiochip0\n    pinctrl-example\n");
  served_.stop();
  const ProgramResult alone = run({"devices", "--json"});
  EXPECT_EQ(alone.exit_code, 0) << alone.err;
  EXPECT_THAT(alone.err, HasSubstr("asking the board"));
  EXPECT_THAT(alone.out, AllOf(StartsWith("["), EndsWith("]\n")));
}

TEST_F(RigCommands, ExportTellsASessionFromAModel) {
  const ProgramResult copied = run({"export", kReadySession, path("stick/")});
  EXPECT_EQ(copied.exit_code, 0) << copied.err;
  EXPECT_EQ(copied.out,
            fmt::format("copied 15 files, 34.6 MB, to {}/{}; each was read back and compared\n",
                        path("stick"),
                        kReadySession));
  EXPECT_THAT(rig().asked(),
              ElementsAre(fmt::format("export {} {}/", kReadySession, path("stick"))));
  const ProgramResult no_folder = run({"export", kReadySession});
  EXPECT_EQ(no_folder.exit_code, 2);
  EXPECT_THAT(no_folder.err, HasSubstr("name the folder to copy it to"));
  const ProgramResult no_format = run({"export", path("out"), path("stick")});
  EXPECT_EQ(no_format.exit_code, 2);
  EXPECT_THAT(no_format.err, HasSubstr("--format and --output"));
  EXPECT_EQ(run({"export", kReadySession, path("stick"), "--format", "openmvs"}).exit_code, 2);
}

TEST_F(RigCommands, WatchUntilIdleEndsAtOnceWhenItIsSo) {
  const ProgramResult result = run({"watch", "--until", "idle"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "");
}

TEST_F(RigCommands, WatchUntilIdleEndsWithTheLastModel) {
  ControlStatus status;
  status.phase = RigPhase::kWorking;
  status.job = JobState::kRunning;
  rig().set_status(status);
  publish(kFrameEvent, render_frame_event(kReadySession, 1));
  // The program asks for the status first and after each event: from the third time on it is idle.
  std::atomic<int> asked = 0;
  rig().on_status([&] {
    if (++asked == 3) {
      rig().set_status({});
      publish(kPhaseEvent, render_phase_event(RigPhase::kIdle, ""));
    } else {
      publish("storage", "{}");
    }
  });
  const ProgramResult result = run({"watch", "--until", "idle"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GE(asked, 3);
}

TEST_F(RigCommands, WatchUntilModelTellsHowItEnded) {
  publish(kProgressEvent, render_progress_event({kReadySession, "mapping", 1, 2}));
  publish(kModelEvent, render_model_event({kReadySession, ModelEventOutcome::kReady, "done"}));
  publish(kModelEvent, render_model_event({kReadySession, ModelEventOutcome::kNone, "too few"}));
  const ProgramResult ready = run({"watch", "--until", "model", "--after", "0"});
  EXPECT_EQ(ready.exit_code, 0) << ready.err;
  EXPECT_EQ(ready.out,
            fmt::format("progress session={0} stage=mapping done=1 total=2\n"
                        "model    session={0} outcome=ready message=done\n",
                        kReadySession));
  const ProgramResult none = run({"watch", "--until", "model", "--after", "2", "--json"});
  EXPECT_EQ(none.exit_code, 4);
  EXPECT_THAT(none.err, HasSubstr("too few"));
  EXPECT_EQ(none.out,
            fmt::format("{{\"number\":3,\"event\":\"model\",\"data\":{}}}\n",
                        render_model_event({kReadySession, ModelEventOutcome::kNone, "too few"})));
}

TEST_F(RigCommands, WatchEndsWithAnInterrupt) {
  publish(kPhaseEvent, render_phase_event(RigPhase::kIdle, ""));
  const std::string command = fmt::format(
      "'{0}' watch --after 0 --socket '{1}' > '{2}' & pid=$!; until [ -s '{2}' ]; do :; done; "
      "kill -INT $pid; wait $pid",
      program_path(),
      socket_,
      path("seen"));
  const ProgramResult result = run_program({"sh", "-c", command});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(contents(path("seen")), "phase    phase=idle session=\n");
}

TEST_F(RigCommands, RecordEndsWithItsFrames) {
  capture_when_started(5);
  const ProgramResult result = run({"record", "--frames", "3"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(rig().asked(), ElementsAre("start", "finish"));
  EXPECT_THAT(result.out, StartsWith(std::string(kClosedSession) + "\n"));
  EXPECT_THAT(result.out, HasSubstr(std::string("/data/") + kClosedSession));
}

TEST_F(RigCommands, RecordEndsWithItsTime) {
  capture_when_started(2);
  EXPECT_EQ(run({"record", "--seconds", "0.2"}).exit_code, 0);
  EXPECT_THAT(rig().asked(), ElementsAre("start", "finish"));
}

TEST_F(RigCommands, RecordEndsWhenTheRigClosesTheSession) {
  rig().on_command([this](const std::string& /*start*/) {
    ControlStatus status;
    status.phase = RigPhase::kCapturing;
    status.session_id = kClosedSession;
    rig().set_status(status);
    rig().on_status([this] {
      rig().on_status({});
      publish(kPhaseEvent, render_phase_event(RigPhase::kWorking, ""));  // by the button
    });
  });
  const ProgramResult result = run({"record", "--frames", "9"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(rig().asked(), ElementsAre("start")) << "there is nothing to finish";
}

TEST_F(RigCommands, RecordWaitsUntilTheSessionIsThere) {
  rig().on_command([this](const std::string& what) {
    ControlStatus status;
    status.phase = what == "start" ? RigPhase::kCapturing : RigPhase::kIdle;
    rig().set_status(status);
    if (what == "start") {
      rig().on_status([this] { open_late(); });
    }
  });
  const ProgramResult result = run({"record", "--frames", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, StartsWith(kClosedSession));
}

TEST_F(RigCommands, RecordSaysThatNoSessionBegan) {
  rig().on_command([this](const std::string& /*start*/) {
    ControlStatus status;
    status.phase = RigPhase::kFault;
    status.fault = "the disk cannot be written";
    rig().set_status(status);
  });
  const ProgramResult result = run({"record"});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("the disk cannot be written"));
}

TEST_F(RigCommands, RecordLeavesAnOpenSessionAlone) {
  ControlStatus status;
  status.phase = RigPhase::kCapturing;
  status.session_id = kReadySession;
  rig().set_status(status);
  const ProgramResult result = run({"record", "--frames", "3"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("is open already"));
  EXPECT_THAT(rig().asked(), IsEmpty());
}

TEST_F(RigCommands, ExplainThemselves) {
  for (const char* command :
       {"status", "trigger", "sessions", "watch", "record", "devices", "export"}) {
    const ProgramResult help = run_trigmesh({command, "--help"});
    EXPECT_EQ(help.exit_code, 0) << command;
    EXPECT_THAT(help.out, AllOf(HasSubstr("Examples:"), HasSubstr("--socket"))) << command;
  }
}

}  // namespace
}  // namespace trigmesh::test_support
