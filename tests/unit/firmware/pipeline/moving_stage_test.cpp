#include "firmware/pipeline/moving_stage.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {
namespace {

std::vector<std::uint8_t> png_with_white(const cv::Rect& white, cv::Size size = {20, 10}) {
  cv::Mat mask(size, CV_8UC1, cv::Scalar(0));
  mask(white).setTo(255);
  return *encode_png(mask);
}

std::vector<DenseView> two_views() {
  std::vector<DenseView> views(2);
  views[0].name = "left/a.jpg";
  views[1].name = "b.png";
  return views;
}

PhotoSet photographs() {
  PhotoSet photos;
  photos.names = {"b.png", "left/a.jpg", "not in the model.jpg"};
  return photos;
}

TEST(MovingStage, MasksGoByTheNameOfThePhotograph) {
  const PhotoSet photos = photographs();
  const auto mask = png_with_white({0, 0, 4, 4});
  const PhotoSet masked = with_masks(photos, two_views(), {mask, std::nullopt});
  EXPECT_EQ(masked.read_mask(0)->has_value(), false);
  EXPECT_EQ(**masked.read_mask(1), mask);
  EXPECT_EQ(masked.read_mask(2)->has_value(), false);
}

TEST(MovingStage, AMaskIsLaidOverThePhotographsOwn) {
  PhotoSet photos = photographs();
  photos.read_mask = [](std::size_t) { return EncodedMask(png_with_white({15, 5, 5, 5})); };
  const PhotoSet masked =
      with_masks(photos, two_views(), {png_with_white({0, 0, 4, 4}), std::nullopt});
  const auto both = decode_mask(**masked.read_mask(1), "a", 20, 10);
  ASSERT_TRUE(both.has_value());
  EXPECT_EQ(cv::countNonZero(*both == 0), 16 + 25);
  EXPECT_EQ(**masked.read_mask(0), png_with_white({15, 5, 5, 5}));
}

TEST(MovingStage, MasksOfDifferentSizesAreAnError) {
  PhotoSet photos = photographs();
  photos.read_mask = [](std::size_t) { return EncodedMask(png_with_white({0, 0, 1, 1}, {9, 9})); };
  const PhotoSet masked =
      with_masks(photos, two_views(), {png_with_white({0, 0, 4, 4}), std::nullopt});
  const auto read = masked.read_mask(1);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(read.error().message, testing::HasSubstr("left/a.jpg"));
}

TEST(MovingStage, FilesAreNamedAsMasksBesidePhotographsAre) {
  const auto mask = png_with_white({0, 0, 4, 4});
  const std::vector<NamedFile> files = mask_files(two_views(), {mask, std::nullopt});
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(files[0].name, "masks/left/a.png");
  EXPECT_EQ(files[0].bytes, std::string(mask.begin(), mask.end()));
}

TEST(MovingStage, SumsUpTheShareOfPixels) {
  const auto section = sum_up_masks(two_views(), {png_with_white({0, 0, 4, 5}), std::nullopt});
  ASSERT_TRUE(section.has_value());
  ASSERT_EQ(section->images.size(), 1U);
  EXPECT_EQ(section->images[0].name, "left/a.jpg");
  EXPECT_DOUBLE_EQ(section->images[0].masked_ratio, 0.1);
  EXPECT_DOUBLE_EQ(section->masked_ratio, 0.05);
}

TEST(MovingStage, ADamagedMaskIsAnError) {
  const auto section = sum_up_masks(two_views(), {std::vector<std::uint8_t>{1, 2}, std::nullopt});
  ASSERT_FALSE(section.has_value());
  EXPECT_EQ(section.error().code, ErrorCode::kCorruptData);
}

}  // namespace
}  // namespace trigmesh
