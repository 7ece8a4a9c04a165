#include "sfm/exchange/colmap_binary.hpp"

#include <cstdint>
#include <cstring>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/exchange/example_scene.hpp"

namespace trigmesh {
namespace {

using test_support::example_scene;
using test_support::expect_same_scene;
using ::testing::HasSubstr;

template <typename T>
T value_at(const std::string& bytes, std::size_t position) {
  T value{};
  std::memcpy(&value, bytes.data() + position, sizeof(T));
  return value;
}

template <typename T>
void set_value(std::string& bytes, std::size_t position, T value) {
  std::memcpy(bytes.data() + position, &value, sizeof(T));
}

ColmapBinary example_bytes() {
  return *write_colmap_binary(example_scene(CameraModel::kBrownConrady, 3, 30));
}

TEST(ColmapBinary, ReadsBackExactlyWhatWasWritten) {
  for (const CameraModel model : {CameraModel::kPinhole,
                                  CameraModel::kRadial,
                                  CameraModel::kBrownConrady,
                                  CameraModel::kKannalaBrandt}) {
    const Scene scene = example_scene(model);
    const auto read = read_colmap_binary(*write_colmap_binary(scene));
    ASSERT_TRUE(read.has_value()) << read.error().message;
    expect_same_scene(*read, scene);
  }
}

TEST(ColmapBinary, FollowsTheByteLayout) {
  Scene scene = example_scene(CameraModel::kPinhole, 2, 20);
  const ColmapBinary bytes = *write_colmap_binary(scene);
  EXPECT_EQ(value_at<std::uint64_t>(bytes.cameras, 0), 2U);
  EXPECT_EQ(value_at<std::uint32_t>(bytes.cameras, 8), 1U);  // id
  EXPECT_EQ(value_at<std::int32_t>(bytes.cameras, 12), 1);   // PINHOLE
  EXPECT_EQ(value_at<std::uint64_t>(bytes.cameras, 16), 800U);
  EXPECT_EQ(value_at<double>(bytes.cameras, 48), scene.cameras[0].cx_px + 0.5);
  EXPECT_EQ(bytes.cameras.size(), 8U + 2 * (4 + 4 + 8 + 8 + 4 * 8));
  EXPECT_EQ(value_at<double>(bytes.images, 12), scene.views[0].cam_from_world->rotation.w());
  EXPECT_EQ(value_at<double>(bytes.points, 16), scene.landmarks[0].position_in_world.x());
}

TEST(ColmapBinary, ReadsPosesAlone) {
  const Scene scene = example_scene(CameraModel::kRadial, 4, 20);
  const auto poses = read_colmap_binary_poses(write_colmap_binary(scene)->images);
  ASSERT_TRUE(poses.has_value()) << poses.error().message;
  ASSERT_EQ(poses->size(), 4U);
  EXPECT_EQ((*poses)[3].name, scene.views[3].name);
  EXPECT_EQ((*poses)[3].cam_from_world.translation, scene.views[3].cam_from_world->translation);
}

TEST(ColmapBinary, RefusesCountsThatTheFileCannotHold) {
  for (std::string ColmapBinary::*file :
       {&ColmapBinary::cameras, &ColmapBinary::images, &ColmapBinary::points}) {
    for (const std::uint64_t count : {std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
      ColmapBinary bytes = example_bytes();
      set_value(bytes.*file, 0, count);
      const auto scene = read_colmap_binary(bytes);
      ASSERT_FALSE(scene.has_value());
      EXPECT_EQ(scene.error().code, ErrorCode::kCorruptData);
      EXPECT_THAT(scene.error().message, HasSubstr("too short"));
    }
  }
}

TEST(ColmapBinary, NamesAnUnknownOrUnsupportedLensModel) {
  for (const std::int32_t model : {-1, 7, 1000}) {
    ColmapBinary bytes = example_bytes();
    set_value(bytes.cameras, 12, model);
    const auto scene = read_colmap_binary(bytes);
    ASSERT_FALSE(scene.has_value());
    EXPECT_EQ(scene.error().code, ErrorCode::kUnsupported) << scene.error().message;
  }
}

TEST(ColmapBinary, RefusesValuesThatAreNotFinite) {
  ColmapBinary bytes = example_bytes();
  set_value(bytes.images, 12, std::nan(""));
  EXPECT_EQ(read_colmap_binary(bytes).error().code, ErrorCode::kCorruptData);
  bytes = example_bytes();
  set_value(bytes.points, 16, std::numeric_limits<double>::infinity());
  EXPECT_EQ(read_colmap_binary(bytes).error().code, ErrorCode::kCorruptData);
}

TEST(ColmapBinary, RefusesEveryTruncation) {
  const ColmapBinary whole = example_bytes();
  for (std::string ColmapBinary::*file :
       {&ColmapBinary::cameras, &ColmapBinary::images, &ColmapBinary::points}) {
    for (std::size_t length = 0; length < (whole.*file).size(); length += 11) {
      ColmapBinary cut = whole;
      (cut.*file).resize(length);
      EXPECT_FALSE(read_colmap_binary(cut).has_value()) << length;
    }
  }
}

}  // namespace
}  // namespace trigmesh
