#include "firmware/pipeline/depth_map_store.hpp"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

DepthMap some_map() {
  DepthMap map;
  map.camera = {
      .width_px = 3, .height_px = 2, .fx_px = 5.0, .fy_px = 6.0, .cx_px = 1.0, .cy_px = 0.5};
  map.depth = cv::Mat(2, 3, CV_32FC1, cv::Scalar(1.5));
  map.normal = cv::Mat(2, 3, CV_32FC3, cv::Scalar(0.0, 0.0, -1.0));
  map.confidence = cv::Mat(2, 3, CV_8UC1, cv::Scalar(200));
  map.depth.at<float>(1, 2) = 0.0F;
  return map;
}

TEST(StoredDepthMap, ComesBackAsItWas) {
  const std::vector<std::uint8_t> bytes = encode_depth_map(some_map());
  const auto map = decode_depth_map(bytes);
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(encode_depth_map(*map), bytes);
  EXPECT_EQ(map->depth.at<float>(1, 2), 0.0F);
  EXPECT_EQ(map->camera.fy_px, 6.0);
  const auto empty = decode_depth_map(encode_depth_map(DepthMap{}));
  ASSERT_TRUE(empty);
  EXPECT_TRUE(empty->depth.empty());
}

TEST(StoredDepthMap, IsRefusedWhenCutOrContradictory) {
  std::vector<std::uint8_t> bytes = encode_depth_map(some_map());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    ASSERT_FALSE(decode_depth_map(std::span(bytes).first(length))) << "cut to " << length;
  }
  bytes[0] = 4;  // the width
  EXPECT_EQ(decode_depth_map(bytes).error().code, ErrorCode::kCorruptData);
}

TEST(DepthMapStore, GivesBackOnlyWhatWasMadeOfTheSameThings) {
  const test_support::TemporaryFolder temporary;
  const auto folder = CheckpointFolder::open(temporary.path());
  ASSERT_TRUE(folder);
  const DepthMapStore store(*folder, "depth", {7, 8});
  EXPECT_FALSE(store.has(1));
  EXPECT_EQ(store.load(1).error().code, ErrorCode::kCorruptData);
  ASSERT_TRUE(store.save(1, some_map()));
  EXPECT_TRUE(store.has(1));
  EXPECT_EQ(encode_depth_map(*store.load(1)), encode_depth_map(some_map()));
  EXPECT_FALSE(DepthMapStore(*folder, "depth", {7, 9}).has(1));
  EXPECT_FALSE(DepthMapStore(*folder, "other", {7, 8}).has(1));
  folder->discard();
}

}  // namespace
}  // namespace trigmesh
