#include "sfm/exchange/model_folder.hpp"

#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/file_io.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/sfm/exchange/example_scene.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using test_support::example_scene;
using test_support::expect_same_scene;
using ::testing::HasSubstr;

class ModelFolder : public ::testing::Test {
 protected:
  const test_support::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(ModelFolder, IsFoundFromEveryFolderAboveIt) {
  const Scene scene = example_scene(CameraModel::kRadial, 3, 30);
  ASSERT_TRUE(write_text_model(scene, folder_ / "model" / "sparse").has_value());
  for (const fs::path& path : {folder_, folder_ / "model", folder_ / "model" / "sparse"}) {
    const auto read = read_model(path);
    ASSERT_TRUE(read.has_value()) << read.error().message;
    expect_same_scene(*read, scene);
  }
}

TEST_F(ModelFolder, IsReadInBinaryToo) {
  const Scene scene = example_scene(CameraModel::kRadial, 3, 30);
  ASSERT_TRUE(write_binary_model(scene, folder_ / "sparse" / "0").has_value());
  const auto read = read_model(folder_);
  ASSERT_TRUE(read.has_value()) << read.error().message;
  expect_same_scene(*read, scene);
  const auto poses = read_model_poses(folder_);
  ASSERT_TRUE(poses.has_value()) << poses.error().message;
  EXPECT_EQ(poses->size(), 3U);
}

TEST_F(ModelFolder, ThatIsMissingIsNotFound) {
  const auto read = read_model(folder_);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(read.error().message, HasSubstr(folder_.string()));
}

TEST_F(ModelFolder, IsNamedWhenAFileInItIsDamaged) {
  ASSERT_TRUE(write_text_model(example_scene(CameraModel::kRadial, 3, 30), folder_).has_value());
  ASSERT_TRUE(write_file_atomically(folder_ / "points3D.txt", "x\n").has_value());
  const auto read = read_model(folder_);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(read.error().message, HasSubstr(folder_.string() + ": points3D.txt, line 1"));
}

TEST_F(ModelFolder, NeedsNoPoints) {
  ASSERT_TRUE(
      write_file_atomically(folder_ / "images.txt", "1 1 0 0 0 1 2 3 1 a.jpg\n\n").has_value());
  ASSERT_TRUE(write_file_atomically(folder_ / "cameras.txt", "1 PINHOLE 640 480 500 500 320 240\n")
                  .has_value());
  const auto text = read_model(folder_);
  ASSERT_TRUE(text.has_value()) << text.error().message;
  EXPECT_EQ(text->registered_count(), 1U);
  EXPECT_TRUE(text->landmarks.empty());
  const fs::path binary = folder_ / "binary";
  ASSERT_TRUE(write_binary_model(*text, binary).has_value());
  fs::remove(binary / "points3D.bin");
  const auto bytes = read_model(binary);
  ASSERT_TRUE(bytes.has_value()) << bytes.error().message;
  EXPECT_EQ(bytes->registered_count(), 1U);
}

TEST_F(ModelFolder, GivesPosesWithoutPoints) {
  ASSERT_TRUE(
      write_file_atomically(folder_ / "images.txt", "1 1 0 0 0 1 2 3 1 a.jpg\n\n").has_value());
  const auto poses = read_model_poses(folder_);
  ASSERT_TRUE(poses.has_value()) << poses.error().message;
  EXPECT_EQ((*poses)[0].name, "a.jpg");
  EXPECT_EQ(read_model(folder_).error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace trigmesh
