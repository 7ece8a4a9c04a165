#include "drivers/camera/picture_in.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(PictureIn, ARawFrameHasAllItsPixels) {
  const FrameLayout layout{PixelFormat::kGrey, 8, 4, 10};
  const std::vector<std::uint8_t> bytes(38);
  EXPECT_TRUE(picture_in(bytes, layout)) << "the padding of the last row may be missing";
  EXPECT_EQ(picture_in(std::span(bytes).first(37), layout).error().kind, FaultKind::kShortFrame);
  EXPECT_EQ(picture_in({}, layout).error().kind, FaultKind::kShortFrame);
}

TEST(PictureIn, AJpegIsWholeAndOfTheAgreedSize) {
  const std::vector<std::uint8_t> jpeg = {0xFF, 0xD8, 0xFF, 0xC0, 0,    8, 8, 0,    4,
                                          0,    8,    1,    0xFF, 0xDA, 0, 2, 0x12, 0xFF,
                                          0,    0x34, 0xFF, 0xD9, 0,    0, 0, 0xFF, 0xD9};
  const auto picture = picture_in(jpeg, {PixelFormat::kJpeg, 8, 4, 0});
  ASSERT_TRUE(picture) << picture.error().message;
  EXPECT_EQ(picture->size(), 22U);
  EXPECT_EQ(picture_in(jpeg, {PixelFormat::kJpeg, 8, 5, 0}).error().kind, FaultKind::kCorruptFrame);
  EXPECT_EQ(picture_in(std::span(jpeg).first(20), {PixelFormat::kJpeg, 8, 4, 0}).error().kind,
            FaultKind::kCorruptFrame);
}

}  // namespace
}  // namespace trigmesh
