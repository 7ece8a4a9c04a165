#include "firmware/base/atomic_files.hpp"

#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/base/file_bytes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class AtomicFiles : public ::testing::Test {
 protected:
  [[nodiscard]] std::string contents(const fs::path& path) const {
    return read_file(folder_ / path, 1000).value_or("(unreadable)");
  }

  const test_support::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(AtomicFiles, ReadsBackWhatWasWritten) {
  const std::string bytes("a\0b\n", 4);
  ASSERT_TRUE(write_file_atomically(folder_ / "file", bytes).has_value());
  EXPECT_EQ(contents("file"), bytes);
}

TEST_F(AtomicFiles, ReplacesAnOldFileAndLeavesNothingBesideIt) {
  ASSERT_TRUE(write_file_atomically(folder_ / "file", "old").has_value());
  ASSERT_TRUE(write_file_atomically(folder_ / "file", "new").has_value());
  EXPECT_EQ(contents("file"), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(AtomicFiles, CannotWriteIntoAFolderThatIsMissing) {
  const auto written = write_file_atomically(folder_ / "missing" / "file", "x");
  ASSERT_FALSE(written.has_value());
  EXPECT_EQ(written.error().code, ErrorCode::kIo);
  EXPECT_THAT(written.error().message, HasSubstr(".file.part: No such file"));
}

TEST_F(AtomicFiles, KeepsTheOldFileWhenTheNewOneCannotTakeItsPlace) {
  fs::create_directories(folder_ / "file" / "inside");
  EXPECT_FALSE(write_file_atomically(folder_ / "file", "x").has_value());
  EXPECT_TRUE(fs::exists(folder_ / "file" / "inside"));
  EXPECT_FALSE(fs::exists(folder_ / ".file.part"));
}

TEST_F(AtomicFiles, MakesFoldersOnce) {
  EXPECT_TRUE(make_directory(folder_ / "a" / "b").has_value());
  EXPECT_TRUE(make_directory(folder_ / "a" / "b").has_value());
  EXPECT_TRUE(fs::is_directory(folder_ / "a" / "b"));
  ASSERT_TRUE(write_file_atomically(folder_ / "file", "x").has_value());
  EXPECT_EQ(make_directory(folder_ / "file").error().code, ErrorCode::kIo);
  EXPECT_EQ(make_directory(folder_ / "file" / "below").error().code, ErrorCode::kIo);
}

TEST_F(AtomicFiles, PutsAStagedFolderWhereThereWasNone) {
  fs::create_directory(folder_ / "staged");
  ASSERT_TRUE(write_file_atomically(folder_ / "staged" / "f", "new").has_value());
  ASSERT_TRUE(replace_directory(folder_ / "staged", folder_ / "target").has_value());
  EXPECT_EQ(contents("target/f"), "new");
  EXPECT_FALSE(fs::exists(folder_ / "staged"));
}

TEST_F(AtomicFiles, ReplacesAFullFolderWhole) {
  for (const char* name : {"staged", "target"}) {
    fs::create_directory(folder_ / name);
    ASSERT_TRUE(write_file_atomically(folder_ / name / name, name).has_value());
  }
  ASSERT_TRUE(replace_directory(folder_ / "staged/", folder_ / "target/").has_value());
  EXPECT_EQ(contents("target/staged"), "staged");
  EXPECT_FALSE(fs::exists(folder_ / "target" / "target"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(AtomicFiles, KeepsTheTargetWhenNothingWasStaged) {
  fs::create_directory(folder_ / "target");
  EXPECT_EQ(replace_directory(folder_ / "staged", folder_ / "target").error().code,
            ErrorCode::kNotFound);
  EXPECT_TRUE(fs::exists(folder_ / "target"));
}

TEST_F(AtomicFiles, PutsBackAFolderThatWasSetAsideAndNeverReplaced) {
  fs::create_directory(folder_ / "model.old");
  ASSERT_TRUE(finish_replacement(real_file_system(), folder_ / "model"));
  EXPECT_TRUE(fs::exists(folder_ / "model"));
  EXPECT_FALSE(fs::exists(folder_ / "model.old"));
}

TEST_F(AtomicFiles, RemovesAFolderThatWasSetAsideAndReplaced) {
  fs::create_directories(folder_ / "model.old" / "inside");
  fs::create_directory(folder_ / "model");
  ASSERT_TRUE(finish_replacement(real_file_system(), folder_ / "model"));
  EXPECT_FALSE(fs::exists(folder_ / "model.old"));
}

TEST_F(AtomicFiles, RemovesAndMeasuresTreesWithoutFollowingLinks) {
  fs::create_directories(folder_ / "tree" / "deep");
  fs::create_directory(folder_ / "kept");
  ASSERT_TRUE(write_file_atomically(folder_ / "kept" / "f", "123"));
  ASSERT_TRUE(write_file_atomically(folder_ / "tree" / "deep" / "f", "12345"));
  ASSERT_TRUE(write_file_atomically(folder_ / "tree" / "f", "12"));
  fs::create_directory_symlink(folder_ / "kept", folder_ / "tree" / "link");
  EXPECT_EQ(tree_size_bytes(real_file_system(), folder_ / "tree").value_or(0), 7U);
  EXPECT_EQ(tree_size_bytes(real_file_system(), folder_ / "none").value_or(1), 0U);
  ASSERT_TRUE(sync_tree(real_file_system(), folder_ / "tree"));
  ASSERT_TRUE(remove_tree(real_file_system(), folder_ / "tree"));
  ASSERT_TRUE(remove_tree(real_file_system(), folder_ / "tree"));
  EXPECT_FALSE(fs::exists(folder_ / "tree"));
  EXPECT_TRUE(fs::exists(folder_ / "kept" / "f"));
}

}  // namespace
}  // namespace trigmesh
