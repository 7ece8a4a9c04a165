#include "drivers/camera/libcamera/drm_format.hpp"

#include <gtest/gtest.h>

#include "drivers/camera/camera_mode.hpp"

namespace trigmesh {
namespace {

/// A DRM code is four letters, the first in the lowest byte.
constexpr std::uint32_t code(const char (&letters)[5]) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) {
    value = (value << 8U) | static_cast<std::uint8_t>(letters[i]);
  }
  return value;
}

TEST(DrmFormat, NamesTheColoursFromTheHighestByteOfALittleEndianWord) {
  // drm_fourcc.h: BGR888 is [23:0] B:G:R, so the byte at the lowest address is red.
  EXPECT_EQ(drm_code_of(PixelFormat::kRgb24), code("BG24"));
  EXPECT_EQ(drm_code_of(PixelFormat::kBgr24), code("RG24"));
}

TEST(DrmFormat, NamesTheRestByTheirOrderInMemory) {
  EXPECT_EQ(drm_code_of(PixelFormat::kJpeg), code("MJPG"));
  EXPECT_EQ(drm_code_of(PixelFormat::kYuyv), code("YUYV"));
  EXPECT_EQ(drm_code_of(PixelFormat::kUyvy), code("UYVY"));
  EXPECT_EQ(drm_code_of(PixelFormat::kNv12), code("NV12"));
  EXPECT_EQ(drm_code_of(PixelFormat::kGrey), code("R8  "));
  EXPECT_EQ(drm_code_of(PixelFormat::kBayerRggb), code("RGGB"));
  EXPECT_EQ(drm_code_of(PixelFormat::kBayerGrbg), code("GRBG"));
  EXPECT_EQ(drm_code_of(PixelFormat::kBayerGbrg), code("GBRG"));
  EXPECT_EQ(drm_code_of(PixelFormat::kBayerBggr), code("BA81"));
}

TEST(DrmFormat, GoesThereAndBack) {
  for (const PixelFormat format : kFormatOrder) {
    EXPECT_EQ(format_of_drm_code(drm_code_of(format)), format) << to_string(format);
  }
  EXPECT_EQ(drm_code_of(PixelFormat::kPng), 0U);
  EXPECT_FALSE(format_of_drm_code(code("XR24")));
}

}  // namespace
}  // namespace trigmesh
