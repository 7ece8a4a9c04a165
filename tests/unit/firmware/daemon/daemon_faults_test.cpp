// What the rig does when something fails, hangs or ends.

#include <chrono>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/daemon/service.hpp"
#include "tests/unit/firmware/daemon/rig_under_test.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class DaemonFaults : public test_support::RigUnderTest {
 protected:
  void begin_stream() {
    start_daemon();
    await("camera", "true");
    ASSERT_TRUE(control().start());
    await("frame", "\"frames\":2}");
  }

  /// Others may be late for a moment on a loaded machine.
  void await_trouble(RigWatch& watch, const std::string& thread) {
    await_that([&] {
      const auto trouble = watch.trouble(clock_.now());
      return trouble && trouble->find(thread) != std::string::npos;
    });
  }
};

TEST_F(DaemonFaults, AStreamGoesOnWhenTheCameraIsPluggedInAgain) {
  begin_stream();
  camera_->is_plugged = false;
  await("camera", "false");
  await("phase", "fault");
  EXPECT_FALSE(status().session_id.empty()) << "the session is kept";
  const std::uint32_t before = status().frames;
  camera_->is_plugged = true;
  await("camera", "true");
  await_that([&] { return status().frames > before; });
  ASSERT_TRUE(control().finish());
  await("phase", "working");
  EXPECT_EQ(sessions().size(), 1U);
}

TEST_F(DaemonFaults, AFullDiskClosesTheSessionAndRefusesPresses) {
  begin_stream();
  disk_.free_bytes = 0;
  await("storage", "full");
  await("phase", "fault");
  EXPECT_EQ(control().start().error().code, ErrorCode::kNoSpace);
  await_that([&] { return status().session_id.empty(); });
  const auto found = sessions();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].manifest.state, SessionState::kCapturing);
  EXPECT_GE(kept_of(found[0].manifest.id).size(), 2U);
  disk_.free_bytes = std::uint64_t{1} << 40U;
  await("storage", "ok");
  EXPECT_TRUE(control().start());
}

TEST_F(DaemonFaults, AWriteProtectedDiskIsAFaultUntilItCanBeWritten) {
  begin_stream();
  disk_.is_read_only = true;
  await("storage", "full");
  EXPECT_THAT(status().fault, HasSubstr("storage"));
  EXPECT_EQ(control().start().error().code, ErrorCode::kNoSpace);
  disk_.is_read_only = false;
  await("storage", "ok");
  const auto found = sessions();  // was closed when the disk came back
  ASSERT_EQ(found.size(), 1U);
  EXPECT_GE(kept_of(found[0].manifest.id).size(), 2U) << "nothing acknowledged is lost";
  await("phase", "working");
  EXPECT_TRUE(control().start());
}

TEST_F(DaemonFaults, StartsWithAFolderThatCannotBeWritten) {
  disk_.is_read_only = true;
  start_daemon();
  await("camera", "true");
  await_that([&] { return status().fault.find("storage") != std::string::npos; });
  disk_.is_read_only = false;
  await("storage", "ok");
  EXPECT_TRUE(control().start());
}

TEST_F(DaemonFaults, ASlowDiskDropsFramesOfStreamsAtTheBoundOfTheQueue) {
  options_.stream_queue_frames = 2;
  begin_stream();
  disk_.set_stuck(true);
  await_that([&] { return daemon_->inbox_counters().dropped_frames >= 3; });
  EXPECT_EQ(daemon_->inbox_counters().most_frames, 2U);
  disk_.set_stuck(false);
  ASSERT_TRUE(control().finish());
  await("phase", "working");
}

TEST_F(DaemonFaults, AHungCameraIsNoticed) {
  start_daemon();
  await("camera", "true");
  RigWatch watch(*daemon_, milliseconds(700), seconds(100));
  await_that([&] { return !watch.trouble(clock_.now()); });
  camera_->is_hanging = true;
  await_trouble(watch, "camera");
}

TEST_F(DaemonFaults, AHungDiskIsNoticed) {
  begin_stream();
  RigWatch watch(*daemon_, milliseconds(700), seconds(100));
  disk_.set_stuck(true);
  await_trouble(watch, "storage");
}

TEST_F(DaemonFaults, AModelThatDoesNotGetOnIsNoticed) {
  begin_stream();
  ASSERT_TRUE(control().finish());
  await("phase", "working");
  RigWatch watch(*daemon_, seconds(100), seconds(10));
  const auto now = clock_.now();
  EXPECT_FALSE(watch.trouble(now));
  EXPECT_TRUE(watch.trouble(now + seconds(11)));
  ++models_.progress;
  EXPECT_FALSE(watch.trouble(now + seconds(12)));
}

class DaemonEnd : public DaemonFaults {};

TEST_F(DaemonEnd, WhileIdle) {
  start_daemon();
  await("camera", "true");
  end_daemon();
}

TEST_F(DaemonEnd, BeforeTheCameraWasTried) {
  start_daemon();
  end_daemon();
}

TEST_F(DaemonEnd, WhileCapturingClosesTheSession) {
  begin_stream();
  end_daemon();
  auto store = SessionStore::open(disk_, clock_, wall_clock_, options_.storage.store.store);
  ASSERT_TRUE(store);
  EXPECT_THAT(store->recovery().recovered, IsEmpty());
  EXPECT_EQ((*store->list())[0].manifest.state, SessionState::kClosed);
}

TEST_F(DaemonEnd, WhileAModelIsMadeKeepsItForTheNextStart) {
  begin_stream();
  ASSERT_TRUE(control().finish());
  await("phase", "working");
  end_daemon();
  for (std::size_t i = 2; i <= 6; ++i) {  // as often as one likes
    start_daemon();
    await_that([&] { return models_.begun().size() == i; });
    EXPECT_EQ(models_.begun()[0], models_.begun()[i - 1]);
    end_daemon();
  }
}

TEST_F(DaemonEnd, WithoutACamera) {
  camera_->is_plugged = false;
  start_daemon();
  await_that([&] { return camera_->starts > 0; });
  end_daemon();
}

TEST_F(DaemonEnd, WithoutADisk) {
  disk_.is_read_only = true;
  start_daemon();
  await_that([&] { return !status().fault.empty(); });
  end_daemon();
}

TEST_F(DaemonEnd, CommandsThatComeTooLateAreAnswered) {
  begin_stream();
  daemon_->request_end();
  const auto late = control().still();
  EXPECT_FALSE(late);
}

class DaemonRestart : public DaemonFaults {};

TEST_F(DaemonRestart, ASessionThatWasOpenIsClosedAndGetsItsModel) {
  begin_stream();
  const std::string id = status().session_id;
  drop_daemon();
  const std::size_t acknowledged = kept_of(id).size();
  start_daemon();
  await_that([&] { return models_.begun().size() == 1; });
  EXPECT_THAT(models_.begun(), ElementsAre(id));
  EXPECT_EQ(kept_of(id).size(), acknowledged);
}

TEST_F(DaemonRestart, ModelsAreMadeFromTheOldestSessionOn) {
  const std::string first = leave_session({SessionState::kClosed});
  const std::string second = leave_session({SessionState::kClosed, SessionState::kReconstructing});
  const std::string third = leave_session({SessionState::kInterrupted});
  (void)leave_session({SessionState::kClosed, SessionState::kModelReady});
  (void)leave_session({}, /*frames=*/0);
  start_daemon();
  for (std::size_t i = 1; i <= 3; ++i) {
    await_that([&] { return models_.begun().size() == i; });
    models_.finish(ModelOutcome::kReady);
  }
  await("phase", "idle");
  EXPECT_THAT(models_.begun(), ElementsAre(first, second, third));
  EXPECT_EQ(sessions().size(), 4U) << "the one without frames is gone";
}

TEST_F(DaemonRestart, AModelThatEndedTheProgramThreeTimesIsNotTriedAgain) {
  const std::string id = leave_session({SessionState::kClosed});
  for (std::size_t i = 1; i <= 3; ++i) {
    start_daemon();
    await_that([&] { return models_.begun().size() == i; });
    drop_daemon();
  }
  start_daemon();
  await_that([&] {
    const auto found = sessions();
    return found.size() == 1 && found[0].manifest.state == SessionState::kModelFailed;
  });
  EXPECT_THAT(models_.begun(), ElementsAre(id, id, id));
}

TEST_F(DaemonRestart, WithoutModelsSessionsAreOnlyKept) {
  options_.rig.rig.makes_models = false;
  (void)leave_session({SessionState::kClosed});
  begin_stream();
  ASSERT_TRUE(control().finish());
  await("phase", "idle");
  EXPECT_THAT(models_.begun(), IsEmpty());
}

class DaemonControl : public DaemonFaults {};

TEST_F(DaemonControl, ExportsAClosedSessionAndNoOpenOne) {
  const test_support::TemporaryFolder stick;
  begin_stream();
  const std::string id = status().session_id;
  EXPECT_EQ(control().export_session(id, stick.path()).error().code, ErrorCode::kInsufficientData);
  ASSERT_TRUE(control().finish());
  await("phase", "working");
  EXPECT_EQ(control().remove_session(id).error().code, ErrorCode::kInsufficientData)
      << "its model is being made";
  models_.finish(ModelOutcome::kReady);
  await("phase", "idle");
  const auto report = control().export_session(id, stick.path());
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(std::filesystem::exists(stick.path() / id / "session.json"));
  EXPECT_TRUE(sessions()[0].manifest.exported);
  EXPECT_TRUE(control().remove_session(id));
  EXPECT_TRUE(sessions().empty());
  EXPECT_EQ(control().remove_session("no id").error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
