#include "drivers/camera/replay/file_buffer.hpp"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

class FileBufferTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path write(std::size_t size) const {
    std::ofstream(folder_.path() / "file", std::ios::binary) << std::string(size, 'x');
    return folder_.path() / "file";
  }

  const test_support::TemporaryFolder folder_;
};

TEST_F(FileBufferTest, KeepsTheMemoryFromFileToFile) {
  auto bytes = read_file_again(write(300'000), 1'000'000, {});
  ASSERT_TRUE(bytes) << bytes.error().message;
  EXPECT_EQ(bytes->size(), 300'000U);
  const std::uint8_t* memory = bytes->data();
  bytes = read_file_again(write(1000), 1'000'000, *std::move(bytes));
  ASSERT_TRUE(bytes) << bytes.error().message;
  EXPECT_EQ(bytes->size(), 1000U);
  EXPECT_EQ(bytes->data(), memory);
}

TEST_F(FileBufferTest, HoldsItsLimitAtTheByte) {
  const auto path = write(1000);
  EXPECT_TRUE(read_file_again(path, 1000, {}));
  const auto beyond = read_file_again(path, 999, {});
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, ErrorCode::kLimitExceeded);
}

TEST_F(FileBufferTest, SaysThatThereIsNoFile) {
  const auto missing = read_file_again(folder_.path() / "none", 10, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_file_again(folder_.path(), 10, {}).error().code, ErrorCode::kIo);
}

}  // namespace
}  // namespace trigmesh
