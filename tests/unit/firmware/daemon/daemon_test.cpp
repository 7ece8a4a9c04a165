// The rig as the operator meets it: presses in, sessions on disk.

#include <algorithm>
#include <chrono>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/firmware/daemon/rig_under_test.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Video : public test_support::RigUnderTest {
 protected:
  /// From the start to a session of some frames whose model is being made.
  std::string capture_first_session() {
    start_daemon();
    await("camera", "true");
    press_and_release();
    await("frame", "\"frames\":2}");
    press_and_release();
    await("phase", "working");
    return sessions()[0].manifest.id;
  }
};

TEST_F(Video, APressBeginsASessionAndTheNextClosesIt) {
  start_daemon();
  await("camera", "true");
  press_and_release();
  await("phase", "capturing");
  await("frame", "\"frames\":5}");
  press_and_release();
  await("phase", "working");
  const auto found = sessions();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_GE(found[0].manifest.frame_count, 5U);
  EXPECT_EQ(found[0].manifest.mode, "video");
  EXPECT_THAT(models_.begun(), ElementsAre(found[0].manifest.id));
  models_.finish(ModelOutcome::kReady);
  await("model", "ready");
  await("phase", "idle");
  EXPECT_EQ(sessions()[0].manifest.state, SessionState::kModelReady);
}

TEST_F(Video, TheJournalTellsEdgesFramesAndStates) {
  const std::string id = capture_first_session();
  std::size_t edges = 0;
  std::size_t frames = 0;
  bool has_counts = false;
  for (const JournalRecord& record : journal_of(id)) {
    edges += std::holds_alternative<EdgeRecord>(record.entry) ? 1U : 0U;
    frames += std::holds_alternative<FrameKept>(record.entry) ? 1U : 0U;
    has_counts = has_counts || std::holds_alternative<DropCounts>(record.entry);
  }
  EXPECT_GE(edges, 3U) << "all but perhaps the last";
  EXPECT_EQ(frames, sessions()[0].manifest.frame_count);
  EXPECT_TRUE(has_counts);
}

TEST_F(Video, TheMakerOfModelsHearsOfTheCaptureFrameByFrame) {
  (void)capture_first_session();
  await_that([&] { return models_.news().back() == "ended"; });  // the storage's thread tells it
  const auto news = models_.news();
  ASSERT_GE(news.size(), 4U);
  EXPECT_EQ(news.front(), "began");
  EXPECT_EQ(news[1], "frame 1");
  EXPECT_EQ(news[2], "frame 2");
}

TEST_F(Video, AdviceFollowsTheMapAndIsShownAndWrittenDown) {
  start_daemon();
  await("camera", "true");
  press_and_release();
  await("frame", "\"frames\":2}");
  MapFollowed map;
  map.photographs = 8;
  map.tracked = 6;
  for (std::uint32_t number = 1; number <= 2; ++number) {
    map.frame = {number, MapFollowing::kLost, milliseconds(30), 0};
    models_.tell(map);
  }
  await("map", "\"following\":\"lost\"");
  await("advice", "go back");
  await_that([&] { return !status().advice.empty(); });
  EXPECT_THAT(status().advice, HasSubstr("last good view"));
  map.frame.following = MapFollowing::kTracked;
  models_.tell(map);
  await("advice", "none");
  await_that([&] { return status().advice.empty(); });
  press_and_release();
  await("phase", "working");
  std::size_t mapped = 0;
  bool has_advice = false;
  for (const JournalRecord& record : journal_of(sessions()[0].manifest.id)) {
    mapped += std::holds_alternative<FrameMapped>(record.entry) ? 1U : 0U;
    const auto* note = std::get_if<Note>(&record.entry);
    has_advice = has_advice || (note != nullptr && note->text.starts_with("advice: lost"));
  }
  EXPECT_EQ(mapped, 3U);
  EXPECT_TRUE(has_advice);
}

TEST_F(Video, AClosedSessionIsContinuedAndItsModelMadeAnew) {
  const std::string id = capture_first_session();
  EXPECT_EQ(control().continue_session(id).error().code, ErrorCode::kInsufficientData)
      << "its model is being made";
  models_.finish(ModelOutcome::kReady);
  await("phase", "idle");
  const std::uint32_t before = sessions()[0].manifest.frame_count;
  ASSERT_TRUE(control().continue_session(id));
  await("phase", "capturing");
  await_that([&] { return status().frames > before; });
  press_and_release();
  await("phase", "working");
  ASSERT_EQ(sessions().size(), 1U);
  EXPECT_GT(sessions()[0].manifest.frame_count, before);
  EXPECT_THAT(models_.begun(), ElementsAre(id, id));
  const auto news = models_.news();
  EXPECT_EQ(std::count(news.begin(), news.end(), "frame 1"), 2) << "also the earlier ones";
}

TEST_F(Video, APressSoonAfterTheModelAddsToItsSession) {
  options_.rig.continue_within = std::chrono::hours(1);
  const std::string id = capture_first_session();
  models_.finish(ModelOutcome::kReady);
  await("phase", "idle");
  const std::uint32_t before = sessions()[0].manifest.frame_count;
  press_and_release();
  await("phase", "capturing");
  await_that([&] { return status().frames > before; });
  EXPECT_EQ(status().session_id, id);
  press_and_release();
  await("phase", "working");
  ASSERT_EQ(sessions().size(), 1U);
  EXPECT_THAT(models_.begun(), ElementsAre(id, id));
}

TEST_F(Video, APressWhileTheModelIsMadeBeginsAnotherSession) {
  options_.rig.continue_within = std::chrono::hours(1);
  (void)capture_first_session();
  press_and_release();
  await("frame");
  EXPECT_EQ(sessions().size(), 2U);
  press_and_release();
  await("phase", "working");
}

TEST_F(Video, APressOnASessionThatIsGoneBeginsANewOne) {
  options_.rig.continue_within = std::chrono::hours(1);
  const std::string id = capture_first_session();
  models_.finish(ModelOutcome::kReady);
  await("phase", "idle");
  ASSERT_TRUE(control().remove_session(id));
  press_and_release();
  await("frame");
  EXPECT_NE(status().session_id, id);
  EXPECT_EQ(sessions().size(), 1U);
  press_and_release();
  await("phase", "working");
}

TEST_F(Video, OnlyASessionThatIsThereIsContinued) {
  start_daemon();
  await("camera", "true");
  EXPECT_EQ(control().continue_session("20200101T000000Z-000000").error().code,
            ErrorCode::kNotFound);
  press_and_release();
  await("frame", "\"frames\":1}");
  EXPECT_EQ(control().continue_session("20200101T000000Z-000000").error().code,
            ErrorCode::kInsufficientData)
      << "a session is open";
  press_and_release();
  await("phase", "working");
}

TEST_F(Video, ASessionContinuedWithoutANewFrameStays) {
  const std::string id = leave_session({SessionState::kClosed, SessionState::kModelReady}, 3);
  start_daemon();
  await("camera", "true");
  camera_->is_hanging = true;
  ASSERT_TRUE(control().continue_session(id));
  ASSERT_TRUE(control().finish());
  camera_->is_hanging = false;
  await("phase", "working");
  ASSERT_EQ(sessions().size(), 1U);
  EXPECT_GE(sessions()[0].manifest.frame_count, 3U);
}

TEST_F(Video, HoldKeepsFramesWhileTheButtonIsDown) {
  options_.rig.rig.video_trigger = VideoTrigger::kHold;
  start_daemon();
  await("camera", "true");
  press();
  await("frame", "\"frames\":3}");
  release();
  await("phase", "working");
  EXPECT_GE(sessions()[0].manifest.frame_count, 3U);
}

TEST_F(Video, ACaptureMayBeginWhileAModelIsMade) {
  (void)capture_first_session();
  press_and_release();  // pauses the model
  await("frame");
  EXPECT_EQ(status().job, JobState::kPaused);
  press_and_release();
  await("phase", "working");
  await_that([&] { return models_.begun().size() == 2; });
  EXPECT_EQ(models_.begun()[0], models_.begun()[1]) << "goes on where it was";
  EXPECT_EQ(status().queued_models, 1U);
  models_.finish(ModelOutcome::kReady);
  await("model", "ready");
  await_that([&] { return models_.begun().size() == 3; });
  models_.finish(ModelOutcome::kFailed);
  await("model", "failed");
}

TEST_F(Video, TheOperatorCancelsAModel) {
  (void)capture_first_session();
  EXPECT_TRUE(control().cancel_model());
  await("model", "cancelled");
  await("phase", "idle");
  EXPECT_EQ(sessions()[0].manifest.state, SessionState::kModelFailed);
  EXPECT_EQ(control().cancel_model().error().code, ErrorCode::kInsufficientData);
}

class Still : public test_support::RigUnderTest {
 protected:
  Still() {
    options_.rig.rig.mode = CaptureMode::kStill;
    options_.capture.stills.history = 8;
    options_.storage.store.session.mode = "still";
  }
};

TEST_F(Still, EachPressGetsOneFrameThatWasNotExposedBeforeIt) {
  start_daemon();
  await("camera", "true");
  std::vector<nanoseconds> presses;
  for (int i = 1; i <= 5; ++i) {
    presses.push_back(clock_.now());
    press_and_release();
    await("frame", "\"frames\":" + std::to_string(i) + "}");
  }
  ASSERT_TRUE(control().finish());
  await("phase", "working");
  const auto kept = kept_of(sessions()[0].manifest.id);
  ASSERT_EQ(kept.size(), presses.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_GE(kept[i].metadata.timestamp, presses[i]);
  }
}

TEST_F(Still, ALongPressClosesTheSession) {
  options_.rig.presses.long_press = milliseconds(300);
  start_daemon();
  await("camera", "true");
  press_and_release();
  await("frame");
  press();
  await("phase", "working");
  release();
  EXPECT_EQ(sessions()[0].manifest.frame_count, 1U);
}

TEST_F(Still, ADoublePressDiscardsTheLastFrame) {
  options_.rig.presses.double_press = milliseconds(2000);
  start_daemon();
  await("camera", "true");
  ASSERT_TRUE(control().still());
  ASSERT_TRUE(control().still());
  EXPECT_EQ(status().frames, 2U);
  await("frame", "\"frames\":2}");
  press_and_release();
  press_and_release();
  await("frame", "\"frames\":1}");
  ASSERT_TRUE(control().undo());
  EXPECT_EQ(status().frames, 0U);
  EXPECT_EQ(control().undo().error().code, ErrorCode::kInsufficientData);
}

TEST_F(Still, AStormOfPressesIsAnsweredPressByPress) {
  start_daemon();
  await("camera", "true");
  for (int i = 0; i < 100; ++i) {
    press_and_release();
  }
  await("frame", "\"frames\":100}");
  ASSERT_TRUE(control().finish());
  await("phase", "working");
  EXPECT_EQ(sessions()[0].manifest.frame_count, 100U);
}

TEST_F(Still, ASessionWithoutFramesGoes) {
  start_daemon();
  await("camera", "true");
  ASSERT_TRUE(control().start());
  ASSERT_TRUE(control().finish());
  await("phase", "idle");
  EXPECT_TRUE(sessions().empty());
}

TEST_F(Still, RefusesAPressWithoutACamera) {
  camera_->is_plugged = false;
  start_daemon();
  await_that([&] { return !status().fault.empty(); });  // else it was not tried yet
  press_and_release();
  await("pressrefused", "no camera");
  EXPECT_EQ(control().still().error().code, ErrorCode::kInsufficientData);
  EXPECT_EQ(status().phase, RigPhase::kFault);
  EXPECT_THAT(status().fault, HasSubstr("camera: no such camera"));
}

}  // namespace
}  // namespace trigmesh
