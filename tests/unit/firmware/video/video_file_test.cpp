#include "firmware/video/video_file.hpp"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

// What needs the program ffmpeg is in tests/integration/video_test.cpp.
class BinaryFile : public ::testing::Test {
 protected:
  [[nodiscard]] bool is_binary(const std::string& bytes) const {
    const auto path = folder_.path() / "file";
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    return is_binary_file(path);
  }

  test_support::TemporaryFolder folder_;
};

TEST_F(BinaryFile, TellsVideosFromLists) {
  EXPECT_TRUE(
      is_binary(std::string("\0\0\0\x20"
                            "ftypisom",
                            12)));
  EXPECT_TRUE(is_binary("\x1A\x45\xDF\xA3"));
  EXPECT_FALSE(is_binary("a.jpg\r\n\tpictures/b \xC3\xA4.jpg\n"));
  EXPECT_FALSE(is_binary(""));
}

TEST_F(BinaryFile, IsNoFolderAndNothingMissing) {
  EXPECT_FALSE(is_binary_file(folder_.path()));
  EXPECT_FALSE(is_binary_file(folder_.path() / "missing"));
}

}  // namespace
}  // namespace trigmesh
