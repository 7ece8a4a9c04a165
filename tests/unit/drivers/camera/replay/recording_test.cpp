#include "drivers/camera/replay/recording.hpp"

#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include <sys/stat.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A folder of its own for each test, removed afterwards.
class RecordingTest : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& content = "pixels") const {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name, std::ios::binary) << content;
  }

  static std::vector<std::string> names(const Recording& recording) {
    std::vector<std::string> result;
    for (const RecordedFrame& frame : recording.frames()) {
      result.push_back(frame.name);
    }
    return result;
  }

  const test_support::TemporaryFolder temporary_;
  const fs::path root_ = temporary_.path();
};

TEST_F(RecordingTest, FindsMasksByTheNameWithAndWithoutItsEnding) {
  for (const char* name : {"images/a.jpg", "images/b.jpg", "images/c.jpg"}) {
    write(name);
  }
  write("masks/a.png", "mask of a");
  write("masks/c.jpg.png", "mask of c");
  const auto recording = Recording::open(root_);
  ASSERT_TRUE(recording) << recording.error().message;
  const auto text_of_mask = [&](std::size_t i) {
    const auto mask = recording->mask(i);
    return mask && *mask ? std::string((*mask)->begin(), (*mask)->end()) : std::string("none");
  };
  EXPECT_EQ(text_of_mask(0), "mask of a");
  EXPECT_EQ(text_of_mask(1), "none");
  EXPECT_EQ(text_of_mask(2), "mask of c");
}

TEST_F(RecordingTest, ReadsASessionOfTheRig) {
  write("frames/000002.jpg");
  write("frames/000001.jpg");
  write("session.json", "{}");
  const auto without_table = Recording::open(root_);
  ASSERT_TRUE(without_table) << without_table.error().message;
  EXPECT_EQ(without_table->kind(), RecordingKind::kSession);
  EXPECT_THAT(names(*without_table), ElementsAre("000001.jpg", "000002.jpg"));
  write("frames.csv", "name,timestamp_ns,exposure_ns,gain\n000001.jpg,9,,\n000002.jpg,8,,\n");
  const auto recording = Recording::open(root_);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(names(*recording), ElementsAre("000002.jpg", "000001.jpg"));
  EXPECT_EQ(recording->frames()[0].timestamp, nanoseconds(8));
}

TEST_F(RecordingTest, ListsPhotographsInNaturalOrderAndCountsTheRest) {
  for (const char* name : {"IMG_10.JPG", "IMG_9.jpeg", "IMG_11.png", "notes.txt", ".hidden.jpg"}) {
    write(name);
  }
  const auto recording = Recording::open(root_);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->kind(), RecordingKind::kPhotoFolder);
  EXPECT_THAT(names(*recording), ElementsAre("IMG_9.jpeg", "IMG_10.JPG", "IMG_11.png"));
  EXPECT_THAT(recording->ignored(), ElementsAre("notes.txt"));
  EXPECT_EQ(recording->frames()[2].format, PixelFormat::kPng);
  EXPECT_FALSE(recording->frames()[0].timestamp);
}

TEST_F(RecordingTest, DoesNotWaitForAPipeNamedLikeAPicture) {
  write("a.jpg");
  fs::create_directory(root_ / "folder.jpg");
  ASSERT_EQ(mkfifo((root_ / "pipe.jpg").c_str(), 0600), 0);
  const auto recording = Recording::open(root_);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(names(*recording), ElementsAre("a.jpg"));
  EXPECT_THAT(recording->ignored(), ElementsAre("folder.jpg", "pipe.jpg"));
}

TEST_F(RecordingTest, TakesSubfoldersOnlyWhenAsked) {
  write("b.jpg");
  write("right/2.jpg");
  write("left/10.jpg");
  write("left/9.jpg");
  write(".cache/3.jpg");
  fs::create_directory_symlink(root_ / "left", root_ / "link");
  const auto flat = Recording::open(root_);
  ASSERT_TRUE(flat) << flat.error().message;
  EXPECT_THAT(names(*flat), ElementsAre("b.jpg"));
  EXPECT_THAT(flat->ignored(), ElementsAre("left", "link", "right"));

  RecordingOptions options;
  options.subfolders = Subfolders::kInclude;
  const auto deep = Recording::open(root_, options);
  ASSERT_TRUE(deep) << deep.error().message;
  EXPECT_THAT(names(*deep), ElementsAre("b.jpg", "left/9.jpg", "left/10.jpg", "right/2.jpg"));
  EXPECT_EQ(deep->frames()[1].name, "left/9.jpg");
}

TEST_F(RecordingTest, OrdersRecordingByTimestamp) {
  write("images/a.jpg", "first name");
  write("images/b.jpg", "second name");
  write("images/extra.jpg");
  write("timestamps.csv", "name,timestamp_ns\na.jpg,200\nb.jpg,100\n");
  const auto recording = Recording::open(root_);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->kind(), RecordingKind::kRecording);
  EXPECT_THAT(names(*recording), ElementsAre("b.jpg", "a.jpg"));
  EXPECT_THAT(recording->ignored(), ElementsAre("extra.jpg"));
  const auto frame = recording->read(0);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(recording->frames()[0].timestamp, nanoseconds(100));
  EXPECT_EQ(std::string(frame->begin(), frame->end()), "second name");
}

TEST_F(RecordingTest, AcceptsRecordingWithoutTimestamps) {
  write("images/2.jpg");
  write("images/10.jpg");
  const auto recording = Recording::open(root_);
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_THAT(names(*recording), ElementsAre("2.jpg", "10.jpg"));
}

TEST_F(RecordingTest, ResolvesListRelativeToTheListFile) {
  write("photos/a.jpg", "A");
  write("photos/b.jpg", "B");
  write("lists/mine.txt", "# chosen\n../photos/b.jpg\n../photos/a.jpg\n");
  const auto recording = Recording::open(root_ / "lists" / "mine.txt");
  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->kind(), RecordingKind::kListFile);
  EXPECT_THAT(names(*recording), ElementsAre("../photos/b.jpg", "../photos/a.jpg"));
  const auto frame = recording->read(0);
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(*frame, std::vector<std::uint8_t>{'B'});
}

TEST_F(RecordingTest, SaysWhatWasTriedWhenThereIsNothing) {
  const auto missing = Recording::open(root_ / "nowhere");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(missing.error().message, HasSubstr("nowhere"));

  write("notes.txt", "");
  const auto empty = Recording::open(root_);
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(empty.error().message, HasSubstr("1 other files"));

  const auto empty_list = Recording::open(root_ / "notes.txt");
  ASSERT_FALSE(empty_list);
  EXPECT_EQ(empty_list.error().code, ErrorCode::kNotFound);
}

TEST_F(RecordingTest, RefusesSinglePictureAsList) {
  write("a.jpg");
  const auto recording = Recording::open(root_ / "a.jpg");
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().code, ErrorCode::kUnsupported);
}

TEST_F(RecordingTest, KeepsDeclaredLimits) {
  write("a.jpg", "123456");
  write("b.jpg", "12");
  RecordingOptions options;
  options.max_frames = 1;
  const auto too_many = Recording::open(root_, options);
  ASSERT_FALSE(too_many);
  EXPECT_EQ(too_many.error().code, ErrorCode::kLimitExceeded);

  options.max_frames = 2;
  options.max_frame_bytes = 5;
  const auto recording = Recording::open(root_, options);
  ASSERT_TRUE(recording) << recording.error().message;
  const auto too_big = recording->read(0);
  ASSERT_FALSE(too_big);
  EXPECT_EQ(too_big.error().code, ErrorCode::kLimitExceeded);
  EXPECT_TRUE(recording->read(1));

  options.max_frames = 0;
  EXPECT_EQ(Recording::open(root_, options).error().code, ErrorCode::kInvalidArgument);
}

TEST_F(RecordingTest, ReportsTheLineOfABadTimestampTable) {
  write("images/a.jpg");
  write("timestamps.csv", "name,timestamp_ns\na.jpg,soon\n");
  const auto recording = Recording::open(root_);
  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(recording.error().message, HasSubstr("timestamps.csv:2"));
}

}  // namespace
}  // namespace trigmesh
