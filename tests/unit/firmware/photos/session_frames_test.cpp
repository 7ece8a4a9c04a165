#include "firmware/photos/session_frames.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/session/store.hpp"
#include "tests/support/manual_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::uint8_t kPicture[] = {1, 2, 3};

FrameJudged judged(std::uint64_t sequence, FrameVerdict verdict) {
  FrameJudged frame;
  frame.sensor_sequence = sequence;
  frame.timestamp = milliseconds(1000 + 40 * sequence);
  frame.verdict = verdict;
  frame.measures.motion_deg = 1.0 + static_cast<double>(sequence);
  return frame;
}

class SessionFrames : public ::testing::Test {
 protected:
  SessionFrames() {
    StoreOptions options;
    options.root = folder_.path() / "sessions";
    auto store = SessionStore::open(real_file_system(), clock_, wall_clock_, options);
    EXPECT_TRUE(store) << store.error().message;
    store_.emplace(*std::move(store));
    NewSession what;
    what.mode = "video";
    auto session = store_->create(what);
    EXPECT_TRUE(session) << session.error().message;
    session_.emplace(*std::move(session));
  }

  std::uint32_t keep(std::uint64_t sequence) {
    FrameMetadata metadata;
    metadata.timestamp = judged(sequence, FrameVerdict::kKept).timestamp;
    metadata.sensor_sequence = sequence;
    return *session_->add_frame(kPicture, metadata);
  }

  /// "name verdict" of each.
  std::vector<std::string> told() {
    const auto frames = read_session_frames(session_->folder());
    EXPECT_TRUE(frames) << frames.error().message;
    std::vector<std::string> lines;
    for (const VideoFrameSection& frame : *frames) {
      lines.push_back(frame.name + " " + std::string(to_string(frame.verdict)));
    }
    return lines;
  }

  test_support::TemporaryFolder folder_;
  test_support::ManualClock clock_;
  test_support::ManualWallClock wall_clock_;
  std::optional<SessionStore> store_;
  std::optional<Session> session_;
};

TEST_F(SessionFrames, TellsVerdictsInTheOrderOfTimeWithNamesOfKeptFrames) {
  keep(3);
  ASSERT_TRUE(session_->record(
      FramesJudged{{judged(3, FrameVerdict::kKept), judged(2, FrameVerdict::kBlurred)}}));
  ASSERT_TRUE(session_->record(FramesJudged{{judged(4, FrameVerdict::kTooLittleMotion)}}));
  ASSERT_TRUE(session_->record(FrameMapped{1, MapFollowing::kTracked, milliseconds(25), 2}));
  ASSERT_TRUE(session_->close("test"));
  EXPECT_THAT(told(),
              ElementsAre("frame 2 blurred", "000001.jpg kept", "frame 4 too little motion"));
  const auto frames = read_session_frames(session_->folder());
  EXPECT_DOUBLE_EQ(frames->at(0).time_s, 0.0);
  EXPECT_DOUBLE_EQ(frames->at(2).time_s, 0.08);
  EXPECT_DOUBLE_EQ(frames->at(1).measures.motion_deg, 4.0);
  ASSERT_TRUE(frames->at(1).live);
  EXPECT_EQ(frames->at(1).live->following, "tracked");
  EXPECT_DOUBLE_EQ(frames->at(1).live->duration_s, 0.025);
  EXPECT_EQ(frames->at(1).live->waiting, 2U);
  EXPECT_FALSE(frames->at(0).live);
}

TEST_F(SessionFrames, ADiscardedFrameIsAsIfItHadNeverBeen) {
  keep(1);
  keep(2);
  ASSERT_TRUE(session_->record(
      FramesJudged{{judged(1, FrameVerdict::kKept), judged(2, FrameVerdict::kKept)}}));
  ASSERT_TRUE(session_->record(FrameMapped{2, MapFollowing::kLost, milliseconds(25), 0}));
  ASSERT_TRUE(session_->undo_last_frame());
  ASSERT_TRUE(session_->close("test"));
  EXPECT_THAT(told(), ElementsAre("000001.jpg kept"));
}

TEST_F(SessionFrames, ASessionOfStillsTellsNothing) {
  keep(1);
  ASSERT_TRUE(session_->close("test"));
  EXPECT_THAT(told(), IsEmpty());
}

TEST_F(SessionFrames, NeedsAJournal) {
  EXPECT_EQ(read_session_frames(folder_.path()).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace trigmesh
