#include "firmware/session/store.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/replay/recording.hpp"
#include "firmware/base/atomic_files.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/session/layout.hpp"
#include "firmware/session/session_export.hpp"
#include "tests/support/faulty_file_system.hpp"
#include "tests/support/manual_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using std::chrono::hours;
using std::chrono::milliseconds;
using test_support::FaultKind;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class Store : public ::testing::Test {
 protected:
  Store() {
    options_.root = temporary_.path() / "sessions";
    wall_clock_.time = hours(24 * 365 * 56);
  }

  [[nodiscard]] SessionStore open() {
    auto store = SessionStore::open(files_, clock_, wall_clock_, options_);
    EXPECT_TRUE(store) << store.error().message;
    return std::move(*store);
  }

  [[nodiscard]] static Session create(SessionStore& store) {
    auto session = store.create({"still", "profile", "[capture]\n", 1, 0xABCDEF});
    EXPECT_TRUE(session) << session.error().message;
    return std::move(*session);
  }

  static std::vector<std::uint8_t> bytes(std::size_t size = 100) {
    return std::vector<std::uint8_t>(size, 0x5A);
  }

  static FrameMetadata at(milliseconds time) {
    FrameMetadata metadata;
    metadata.timestamp = time;
    return metadata;
  }

  static void add_frames(Session& session, int count) {
    for (int i = 0; i < count; ++i) {
      ASSERT_TRUE(session.add_frame(bytes(), at(milliseconds(100 * (i + 1)))));
    }
  }

  /// A session with frames and a model, closed.
  std::string finished(SessionStore& store) {
    Session session = create(store);
    add_frames(session, 2);
    EXPECT_TRUE(session.close("test"));
    EXPECT_TRUE(make_directory(session.staged_model() / "sparse"));
    EXPECT_TRUE(write_file_atomically(session.staged_model() / "sparse" / "images.txt", "model"));
    EXPECT_TRUE(session.publish_model());
    EXPECT_TRUE(session.set_state(SessionState::kModelReady, "test"));
    return session.manifest().id;
  }

  const test_support::TemporaryFolder temporary_{test_support::folder_in_memory()};
  test_support::FaultyFileSystem files_;
  test_support::ManualClock clock_;
  test_support::ManualWallClock wall_clock_;
  StoreOptions options_;
};

TEST_F(Store, KeepsFramesAndSaysWhatIsThere) {
  SessionStore store = open();
  Session session = create(store);
  EXPECT_EQ(session.add_frame(bytes(), at(milliseconds(5))).value(), 1U);
  EXPECT_EQ(session.add_frame(bytes(), at(milliseconds(9))).value(), 2U);
  ASSERT_TRUE(session.close("long press"));
  const auto sessions = store.list().value();
  ASSERT_THAT(sessions, SizeIs(1));
  EXPECT_EQ(sessions[0].manifest.id, "20251218T000000Z-abcdef");
  EXPECT_EQ(sessions[0].manifest.state, SessionState::kClosed);
  EXPECT_EQ(sessions[0].manifest.frame_count, 2U);
  EXPECT_FALSE(sessions[0].has_model);
  EXPECT_GT(sessions[0].size_bytes, 200U);
}

TEST_F(Store, KeepsThePiecesOfAModelUntilItIsDone) {
  const auto piece = [](const Session& session) { return session.work_folder() / "piece"; };
  std::string id;
  {
    SessionStore store = open();
    Session session = create(store);
    add_frames(session, 2);
    id = session.manifest().id;
    ASSERT_TRUE(session.close("test"));
    ASSERT_TRUE(session.set_state(SessionState::kReconstructing, "test"));
    ASSERT_TRUE(write_file_atomically(piece(session), "done"));
    ASSERT_TRUE(make_directory(session.staged_model()));
    ASSERT_TRUE(session.publish_model());
  }
  SessionStore store = open();
  Session session = store.open_session(id).value().session;
  EXPECT_EQ(session.manifest().state, SessionState::kClosed) << "the model may lack parts";
  EXPECT_TRUE(std::filesystem::exists(piece(session)));
  ASSERT_TRUE(session.set_state(SessionState::kModelFailed, "test"));
  EXPECT_FALSE(std::filesystem::exists(piece(store.open_session(id).value().session)));
}

TEST_F(Store, ASessionIsARecording) {
  SessionStore store = open();
  Session session = create(store);
  add_frames(session, 3);
  ASSERT_TRUE(session.undo_last_frame());
  ASSERT_TRUE(session.close("done"));
  const auto recording = Recording::open(session.folder());
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->kind(), RecordingKind::kSession);
  ASSERT_EQ(recording->size(), 2U);
  EXPECT_EQ(recording->frames()[1].name, "000002.jpg");
  EXPECT_EQ(recording->frames()[1].timestamp, milliseconds(200));
  EXPECT_EQ(recording->read(1), bytes());
  EXPECT_THAT(recording->ignored(), IsEmpty());
}

TEST_F(Store, UndoneNumbersAreNotUsedAgain) {
  SessionStore store = open();
  Session session = create(store);
  add_frames(session, 2);
  EXPECT_EQ(session.undo_last_frame().value(), 2U);
  EXPECT_FALSE(fs::exists(session.frame_path(2)));
  EXPECT_EQ(session.add_frame(bytes(), at(milliseconds(9))).value(), 3U);
  EXPECT_EQ(session.undo_last_frame().value(), 3U);
  EXPECT_EQ(session.undo_last_frame().value(), 1U);
  EXPECT_EQ(session.undo_last_frame().error().code, ErrorCode::kInsufficientData);
}

TEST_F(Store, RefusesFramesThatCannotBe) {
  SessionStore store = open();
  Session session = create(store);
  EXPECT_EQ(session.add_frame({}, at(milliseconds(1))).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(session.add_frame(bytes(), at(milliseconds(-1))).error().code,
            ErrorCode::kInvalidArgument);
  EXPECT_FALSE(session.record(FrameKept{}));
  ASSERT_TRUE(session.close("done"));
  EXPECT_TRUE(session.close("again"));
  EXPECT_THAT(session.add_frame(bytes(), at(milliseconds(1))).error().message, HasSubstr("closed"));
}

TEST_F(Store, GoesOnWithASessionThatACrashInterrupted) {
  std::string id;
  {
    SessionStore store = open();
    Session session = create(store);
    add_frames(session, 2);
    id = session.manifest().id;
  }
  SessionStore store = open();
  ASSERT_THAT(store.recovery().recovered, SizeIs(1));
  EXPECT_TRUE(store.recovery().recovered[0].details.was_open);
  auto opened = store.open_session(id);
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_EQ(opened->session.manifest().state, SessionState::kInterrupted);
  EXPECT_EQ(opened->session.manifest().recoveries, 1U);
  EXPECT_EQ(opened->session.add_frame(bytes(), at(milliseconds(300))).value(), 3U);
}

TEST_F(Store, ReportsFramesThatAreGoneAndKeepsThoseADamagedJournalDoesNotTellOf) {
  std::string id;
  {
    SessionStore store = open();
    Session session = create(store);
    add_frames(session, 3);
    id = session.manifest().id;
    fs::remove(session.frame_path(1));
  }
  const fs::path journal = options_.root / id / kJournalName;
  std::string damaged = read_file(journal, kMaxJournalBytes).value();
  const std::size_t last = damaged.rfind("TMJR");
  damaged[damaged.rfind("TMJR", last - 1) + 40] ^= 1;  // frame 2
  ASSERT_TRUE(write_file_atomically(journal, damaged));
  SessionStore store = open();
  const SessionRecovery& recovery = store.recovery().recovered.at(0).details;
  EXPECT_TRUE(recovery.damaged());
  EXPECT_THAT(recovery.damages, testing::Not(IsEmpty()));
  EXPECT_THAT(recovery.missing, ElementsAre(1U));
  EXPECT_THAT(recovery.unlisted, ElementsAre(2U));
  EXPECT_TRUE(fs::exists(options_.root / id / "frames" / "000002.jpg"));
  EXPECT_FALSE(fs::exists(options_.root / id / "frames.csv")) << "it would hide frame 2";
}

TEST_F(Store, StopsBeforeTheReserveIsTouched) {
  options_.limits = {0, 50'000'000, 10'000'000};
  SessionStore store = open();
  Session session = create(store);
  files_.pretend_free(50'000'150);
  EXPECT_TRUE(session.add_frame(bytes(150), at(milliseconds(1))));
  files_.pretend_free(50'000'149);
  const auto refused = session.add_frame(bytes(150), at(milliseconds(2)));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kNoSpace);
  EXPECT_EQ(store.budget().level().value(), StorageLevel::kLow);
  files_.pretend_free(50'000'000);
  EXPECT_EQ(store.budget().level().value(), StorageLevel::kFull);
  files_.pretend_free(60'000'000);
  EXPECT_EQ(store.budget().level().value(), StorageLevel::kOk);
  EXPECT_TRUE(session.close("storage full"));
}

TEST_F(Store, KeepsTheQuota) {
  options_.limits.quota_bytes = 5'000'000;
  SessionStore store = open();
  Session session = create(store);
  EXPECT_TRUE(session.add_frame(bytes(4'000'000), at(milliseconds(1))));
  EXPECT_THAT(session.add_frame(bytes(1'000'001), at(milliseconds(2))).error().message,
              HasSubstr("quota (5000000)"));
  EXPECT_EQ(store.create({}).error().code, ErrorCode::kNoSpace);
}

TEST_F(Store, RemovesTheOldestFinishedSessionsToMakeRoom) {
  SessionStore store = open();
  std::vector<std::string> ids;
  for (int i = 0; i < 3; ++i) {
    ids.push_back(finished(store));
  }
  options_.retention = {RetentionRules::Removal::kWhenNeeded, false, false};
  options_.limits.reserve_bytes = 1'000;
  store = open();
  files_.pretend_free(1'000);
  EXPECT_THAT(store.make_room(1).value(), IsEmpty()) << "nothing was exported";
  ASSERT_TRUE(store.open_session(ids[1])->session.mark_exported());
  EXPECT_THAT(store.make_room(1).value(), ElementsAre(ids[1]));
  options_.retention.not_exported = true;
  store = open();
  EXPECT_THAT(store.make_room(1).value(), ElementsAre(ids[0]));
  EXPECT_THAT(store.list().value(), SizeIs(1));
}

TEST_F(Store, IdsGoUpWhenTheClockGoesBack) {
  SessionStore store = open();
  const std::string first = create(store).manifest().id;
  wall_clock_.time = hours(1);
  Session second = create(store);
  EXPECT_GT(second.manifest().id, first);
  EXPECT_EQ(second.manifest().created_wall, hours(1));
}

TEST_F(Store, OpensOnlyWhatIsASession) {
  SessionStore store = open();
  EXPECT_EQ(store.open_session("../other").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(store.remove("..").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(store.open_session("20260101T000000Z-000000").error().code, ErrorCode::kNotFound);
}

TEST_F(Store, LeavesAFolderAloneThatItCannotRead) {
  fs::create_directories(options_.root / "20260101T000000Z-000000");
  SessionStore store = open();
  ASSERT_THAT(store.recovery().unreadable, SizeIs(1));
  EXPECT_THAT(store.list().value(), IsEmpty());
  EXPECT_TRUE(fs::exists(options_.root / "20260101T000000Z-000000"));
}

class Export : public Store {
 protected:
  Export() { fs::create_directory(stick_); }

  const fs::path stick_ = temporary_.path() / "stick";
};

TEST_F(Export, CopiesEverythingAndVerifies) {
  SessionStore store = open();
  const std::string id = finished(store);
  const auto report = export_session(files_, store.folder_of(id), stick_);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->folder, stick_ / id);
  EXPECT_EQ(report->file_count, 6U);  // manifest, journal, table, two frames, model
  EXPECT_EQ(read_file(stick_ / id / "model" / "sparse" / "images.txt", 100).value(), "model");
  EXPECT_THAT(read_file(stick_ / id / kChecksumsName, 10'000).value(),
              HasSubstr("  frames/000002.jpg\n"));
  ASSERT_TRUE(export_session(files_, store.folder_of(id), stick_)) << "an older copy is replaced";
  EXPECT_EQ(std::distance(fs::directory_iterator(stick_), {}), 1);
}

TEST_F(Export, LeavesNothingAfterAFailureAtAnyCall) {
  SessionStore store = open();
  const std::string id = finished(store);
  const std::size_t before = files_.calls();
  ASSERT_TRUE(export_session(files_, store.folder_of(id), stick_));
  const std::size_t calls = files_.calls() - before;
  std::size_t failures = 0;
  for (std::size_t call = 1; call <= calls; ++call) {
    fs::remove_all(stick_);
    fs::create_directory(stick_);
    files_.set_fault({FaultKind::kFail, files_.calls() + call, ENOSPC});
    const auto report = export_session(files_, store.folder_of(id), stick_);
    failures += report.has_value() ? 0U : 1U;
    EXPECT_FALSE(fs::exists(stick_ / ("." + id + ".part"))) << "call " << call;
    const bool complete = fs::exists(stick_ / id / kChecksumsName);
    EXPECT_EQ(fs::exists(stick_ / id), complete) << "call " << call;
    EXPECT_TRUE(!report || complete);
  }
  EXPECT_GT(failures, calls / 2);
}

TEST_F(Export, SaysBeforehandThatTheStickIsTooSmall) {
  SessionStore store = open();
  const std::string id = finished(store);
  files_.pretend_free(10);
  const auto refused = export_session(files_, store.folder_of(id), stick_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kNoSpace);
  EXPECT_EQ(export_session(files_, store.folder_of(id), stick_ / "none").error().code,
            ErrorCode::kNotFound);
}

TEST_F(Export, StopsWhenAskedTo) {
  SessionStore store = open();
  const std::string id = finished(store);
  const auto stopped = export_session(
      files_, store.folder_of(id), stick_, [](std::uint64_t, std::uint64_t) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(fs::is_empty(stick_));
}

}  // namespace
}  // namespace trigmesh
