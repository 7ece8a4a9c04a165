#include "drivers/camera/pixel_format.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(PixelFormat, RowsTakeWhatTheirPixelsTake) {
  EXPECT_EQ(row_bytes(PixelFormat::kYuyv, 640), 1280U);
  EXPECT_EQ(row_bytes(PixelFormat::kUyvy, 3), 8U) << "pixels come in pairs";
  EXPECT_EQ(row_bytes(PixelFormat::kNv12, 640), 640U);
  EXPECT_EQ(row_bytes(PixelFormat::kNv12, 5), 6U) << "chroma comes in pairs";
  EXPECT_EQ(row_bytes(PixelFormat::kBayerGbrg, 7), 7U);
  EXPECT_EQ(row_bytes(PixelFormat::kBgr24, 636), 1908U);
  EXPECT_EQ(row_bytes(PixelFormat::kJpeg, 640), 0U);
}

TEST(PixelFormat, NeededBytesStopAtTheLastPixel) {
  EXPECT_EQ(needed_bytes({PixelFormat::kGrey, 4, 3, 10}), 24U);
  EXPECT_EQ(needed_bytes({PixelFormat::kNv12, 4, 4, 8}), 44U);
  EXPECT_EQ(needed_bytes({PixelFormat::kNv12, 4, 3, 4}), 20U) << "half of 3 rows is 2";
  EXPECT_EQ(needed_bytes({PixelFormat::kYuyv, 2, 1, 64}), 4U);
  EXPECT_EQ(needed_bytes({PixelFormat::kJpeg, 640, 480, 0}), 0U);
  EXPECT_EQ(needed_bytes({PixelFormat::kGrey, 0, 0, 0}), 0U);
}

}  // namespace
}  // namespace trigmesh
