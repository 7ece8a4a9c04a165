#include "firmware/session/journal.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/session/journal_codec.hpp"
#include "tests/support/faulty_file_system.hpp"
#include "tests/support/manual_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using test_support::Fault;
using test_support::FaultKind;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class Journal : public ::testing::Test {
 protected:
  [[nodiscard]] JournalWriter open() {
    auto opened = JournalWriter::open(files_, path_, clock_, wall_clock_);
    EXPECT_TRUE(opened) << opened.error().message;
    return std::move(opened->writer);
  }

  [[nodiscard]] JournalScan scan() { return read_journal(files_, path_).value(); }

  [[nodiscard]] static std::vector<std::string> notes(const JournalScan& scan) {
    std::vector<std::string> texts;
    for (const JournalRecord& record : scan.records) {
      texts.push_back(std::get<Note>(record.entry).text);
    }
    return texts;
  }

  void write_notes(std::initializer_list<const char*> texts) {
    JournalWriter writer = open();
    for (const char* text : texts) {
      ASSERT_TRUE(writer.append(Note{text}));
    }
  }

  [[nodiscard]] std::string bytes() const { return read_file(path_, kMaxJournalBytes).value(); }

  void set_bytes(const std::string& bytes) {
    ASSERT_TRUE(write_file_atomically(path_, bytes, Durability::kCache));
  }

  const test_support::TemporaryFolder temporary_;
  const std::filesystem::path path_ = temporary_.path() / "journal";
  test_support::FaultyFileSystem files_;
  test_support::ManualClock clock_;
  test_support::ManualWallClock wall_clock_;
};

constexpr std::size_t kNoteOverhead = kJournalHeaderBytes + kJournalTrailerBytes + 8;

TEST_F(Journal, GoesOnWhereItStopped) {
  clock_.time = nanoseconds(7);
  wall_clock_.time = nanoseconds(8);
  write_notes({"a", "b"});
  write_notes({"c"});
  const JournalScan found = scan();
  EXPECT_THAT(notes(found), ::testing::ElementsAre("a", "b", "c"));
  EXPECT_THAT(found.damages, IsEmpty());
  EXPECT_EQ(found.records[2].sequence, 2U);
  EXPECT_EQ(found.records[2].monotonic, nanoseconds(7));
  EXPECT_EQ(found.records[2].wall, nanoseconds(8));
}

TEST_F(Journal, CutsATornTailAndGoesOn) {
  write_notes({"a", "b"});
  const std::string whole = bytes();
  for (std::size_t size = kNoteOverhead + 1; size < whole.size(); ++size) {
    set_bytes(whole.substr(0, size));
    EXPECT_EQ(scan().torn_bytes, size - kNoteOverhead - 1);
    write_notes({"c"});
    const JournalScan found = scan();
    EXPECT_THAT(notes(found), ::testing::ElementsAre("a", "c"));
    EXPECT_THAT(found.damages, IsEmpty());
  }
}

TEST_F(Journal, ReportsDamageInTheMiddleWithItsPlaceAndKeepsTheRest) {
  write_notes({"a", "b", "c"});
  std::string damaged = bytes();
  const std::size_t record = kNoteOverhead + 1;
  damaged[record + kJournalHeaderBytes + 8] = 'X';
  set_bytes(damaged);
  const JournalScan found = scan();
  EXPECT_THAT(notes(found), ::testing::ElementsAre("a", "c"));
  ASSERT_FALSE(found.damages.empty());
  EXPECT_EQ(found.damages[0].offset_bytes, record);
  EXPECT_EQ(found.damages[0].size_bytes, record);
  EXPECT_THAT(found.damages[0].reason, HasSubstr("checksum"));
  EXPECT_EQ(found.torn_bytes, 0U);
}

TEST_F(Journal, NoticesThatARecordIsMissing) {
  write_notes({"a", "b", "c"});
  std::string shortened = bytes();
  shortened.erase(kNoteOverhead + 1, kNoteOverhead + 1);
  set_bytes(shortened);
  const JournalScan found = scan();
  ASSERT_THAT(found.damages, SizeIs(1));
  EXPECT_THAT(found.damages[0].reason, HasSubstr("record 2 stands where 1 was expected"));
}

TEST_F(Journal, IsEmptyWhenNothingWasWritten) {
  EXPECT_THAT(scan_journal({}).records, IsEmpty());
  EXPECT_EQ(read_journal(files_, path_).error().code, ErrorCode::kNotFound);
}

TEST_F(Journal, LeavesNothingOfARecordThatDidNotFit) {
  JournalWriter writer = open();
  ASSERT_TRUE(writer.append(Note{"a"}));
  const std::size_t size = bytes().size();
  files_.set_fault({FaultKind::kShortThenFail, files_.calls() + 1, ENOSPC});
  const auto refused = writer.append(Note{"b"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kNoSpace);
  EXPECT_EQ(bytes().size(), size);
  EXPECT_FALSE(writer.is_broken());
  ASSERT_TRUE(writer.append(Note{"c"}));
  EXPECT_THAT(notes(scan()), ::testing::ElementsAre("a", "c"));
}

TEST_F(Journal, WritesNothingMoreAfterAFailedSync) {
  JournalWriter writer = open();
  ASSERT_TRUE(writer.append(Note{"a"}));
  files_.set_fault({FaultKind::kFail, files_.calls() + 1, EIO});
  EXPECT_FALSE(writer.sync());
  EXPECT_TRUE(writer.is_broken());
  const auto refused = writer.append(Note{"b"});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("open the session again"));
}

TEST_F(Journal, AcknowledgedRecordsAreOnTheDiskAndOthersWait) {
  JournalWriter writer = open();
  const std::size_t before = files_.calls();
  ASSERT_TRUE(writer.append(EdgeRecord{}));
  EXPECT_EQ(files_.calls() - before, 1U);  // the write
  ASSERT_TRUE(writer.append(FrameKept{}));
  EXPECT_EQ(files_.calls() - before, 3U);  // the write and the fsync
  ASSERT_TRUE(writer.sync());
  EXPECT_EQ(files_.calls() - before, 3U);  // nothing to do
}

TEST_F(Journal, SyncsWhatSomebodyActsOn) {
  EXPECT_TRUE(must_be_durable(FrameKept{}));
  EXPECT_TRUE(must_be_durable(FrameRefused{FrameRefusal::kUndone, 1, 0, 0.0}));
  EXPECT_TRUE(must_be_durable(StateChange{}));
  EXPECT_TRUE(must_be_durable(SettingsUsed{}));
  EXPECT_FALSE(must_be_durable(FrameRefused{FrameRefusal::kBlurred, 0, 0, 0.0}));
  EXPECT_FALSE(must_be_durable(EdgeRecord{}));
  EXPECT_FALSE(must_be_durable(Note{}));
}

}  // namespace
}  // namespace trigmesh
