#include "sfm/exchange/file_io.hpp"

#include <cerrno>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class FileIo : public ::testing::Test {
 protected:
  [[nodiscard]] std::string contents(const fs::path& path) const {
    return read_file(folder_ / path, 1000).value_or("(unreadable)");
  }

  const test_support::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(FileIo, ReadsBackWhatWasWritten) {
  const std::string bytes("a\0b\n", 4);
  ASSERT_TRUE(write_file_atomically(folder_ / "file", bytes).has_value());
  EXPECT_EQ(contents("file"), bytes);
}

TEST_F(FileIo, ReplacesAnOldFileAndLeavesNothingBesideIt) {
  ASSERT_TRUE(write_file_atomically(folder_ / "file", "old").has_value());
  ASSERT_TRUE(write_file_atomically(folder_ / "file", "new").has_value());
  EXPECT_EQ(contents("file"), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(FileIo, SaysThatAFileDoesNotExist) {
  const auto read = read_file(folder_ / "missing", 10);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(read.error().message, HasSubstr("missing: No such file"));
}

TEST_F(FileIo, RefusesFilesOverTheLimit) {
  ASSERT_TRUE(write_file_atomically(folder_ / "file", "0123456789").has_value());
  EXPECT_TRUE(read_file(folder_ / "file", 10).has_value());
  EXPECT_EQ(read_file(folder_ / "file", 9).error().code, ErrorCode::kLimitExceeded);
  EXPECT_EQ(read_file("/dev/zero", 100'000).error().code, ErrorCode::kLimitExceeded);
}

TEST_F(FileIo, DoesNotReadAFolder) {
  EXPECT_EQ(read_file(folder_, 10).error().code, ErrorCode::kIo);
}

TEST_F(FileIo, CannotWriteIntoAFolderThatIsMissing) {
  const auto written = write_file_atomically(folder_ / "missing" / "file", "x");
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().code, ErrorCode::kIo);
  EXPECT_THAT(written.error().message, HasSubstr("file: No such file"));
}

TEST_F(FileIo, KeepsTheOldFileWhenTheNewOneCannotTakeItsPlace) {
  fs::create_directories(folder_ / "file" / "inside");
  EXPECT_FALSE(write_file_atomically(folder_ / "file", "x").has_value());
  EXPECT_TRUE(fs::exists(folder_ / "file" / "inside"));
  EXPECT_FALSE(fs::exists(folder_ / ".file.part"));
}

TEST_F(FileIo, TellsAFullDiskFromOtherFailures) {
  EXPECT_EQ(system_error(ENOSPC, "cannot write", "f").code, ErrorCode::kNoSpace);
  EXPECT_EQ(system_error(EDQUOT, "cannot write", "f").code, ErrorCode::kNoSpace);
  EXPECT_EQ(system_error(EACCES, "cannot write", "f").code, ErrorCode::kIo);
  EXPECT_EQ(system_error(ENOSPC, "cannot write", "f").message,
            "cannot write f: No space left on device");
}

TEST_F(FileIo, MakesFoldersOnce) {
  EXPECT_TRUE(make_directory(folder_ / "a" / "b").has_value());
  EXPECT_TRUE(make_directory(folder_ / "a" / "b").has_value());
  EXPECT_TRUE(fs::is_directory(folder_ / "a" / "b"));
  ASSERT_TRUE(write_file_atomically(folder_ / "file", "x").has_value());
  EXPECT_EQ(make_directory(folder_ / "file").error().code, ErrorCode::kIo);
  EXPECT_EQ(make_directory(folder_ / "file" / "below").error().code, ErrorCode::kIo);
}

TEST_F(FileIo, PutsAStagedFolderWhereThereWasNone) {
  fs::create_directory(folder_ / "staged");
  ASSERT_TRUE(write_file_atomically(folder_ / "staged" / "f", "new").has_value());
  ASSERT_TRUE(replace_directory(folder_ / "staged", folder_ / "target").has_value());
  EXPECT_EQ(contents("target/f"), "new");
  EXPECT_FALSE(fs::exists(folder_ / "staged"));
}

TEST_F(FileIo, ReplacesAFullFolderWhole) {
  for (const char* name : {"staged", "target"}) {
    fs::create_directory(folder_ / name);
    ASSERT_TRUE(write_file_atomically(folder_ / name / name, name).has_value());
  }
  ASSERT_TRUE(replace_directory(folder_ / "staged/", folder_ / "target/").has_value());
  EXPECT_EQ(contents("target/staged"), "staged");
  EXPECT_FALSE(fs::exists(folder_ / "target" / "target"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(FileIo, KeepsTheTargetWhenNothingWasStaged) {
  fs::create_directory(folder_ / "target");
  EXPECT_EQ(replace_directory(folder_ / "staged", folder_ / "target").error().code,
            ErrorCode::kNotFound);
  EXPECT_TRUE(fs::exists(folder_ / "target"));
}

}  // namespace
}  // namespace trigmesh
