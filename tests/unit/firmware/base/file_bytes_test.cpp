#include "firmware/base/file_bytes.hpp"

#include <cerrno>
#include <cstdio>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A file of its own for each test: suites run side by side.
class FileBytes : public ::testing::Test {
 protected:
  void write(const std::string& content) const {
    std::ofstream(path_, std::ios::binary) << content;
  }

  const test_support::TemporaryFolder folder_;
  const fs::path path_ = folder_.path() / "file";
};

TEST_F(FileBytes, ReadsEveryByteAsItIs) {
  write(std::string("a\0\xFF\n", 4));
  const auto bytes = read_file_bytes(path_, 4);
  ASSERT_TRUE(bytes) << bytes.error().message;
  EXPECT_THAT(*bytes, ElementsAre('a', 0, 0xFF, '\n'));
  EXPECT_EQ(read_file(path_, 4), std::string("a\0\xFF\n", 4));
}

TEST_F(FileBytes, ReadsAnEmptyFileAndOneOfManyBlocks) {
  write("");
  EXPECT_EQ(read_file(path_, 0), "");
  const std::string large(300'000, 'x');
  write(large);
  EXPECT_EQ(read_file(path_, large.size()), large);
}

TEST_F(FileBytes, KeepsTheLimitForFilesAndForDevicesWithoutEnd) {
  write("12345");
  EXPECT_EQ(read_file(path_, 4).error().code, ErrorCode::kLimitExceeded);
  EXPECT_EQ(read_file_bytes("/dev/zero", 100'000).error().code, ErrorCode::kLimitExceeded);
}

TEST_F(FileBytes, TellsMissingFromUnreadable) {
  const auto missing = read_file(path_ / "below", 4);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(missing.error().message, HasSubstr("below: No such file"));
  EXPECT_EQ(read_file(fs::temp_directory_path(), 4).error().code, ErrorCode::kIo);
}

TEST(SystemError, SortsReasonsByWhatTheCallerCanDo) {
  EXPECT_EQ(system_error(ENOSPC, "cannot write", "f").code, ErrorCode::kNoSpace);
  EXPECT_EQ(system_error(EDQUOT, "cannot write", "f").code, ErrorCode::kNoSpace);
  EXPECT_EQ(system_error(ENOENT, "cannot open", "f").code, ErrorCode::kNotFound);
  const Error denied = system_error(EACCES, "cannot open", "f");
  EXPECT_EQ(denied.code, ErrorCode::kIo);
  EXPECT_EQ(denied.message, "cannot open f: Permission denied");
}

}  // namespace
}  // namespace trigmesh
