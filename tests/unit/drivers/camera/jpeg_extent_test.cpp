#include "drivers/camera/jpeg_extent.hpp"

#include <vector>

#include <turbojpeg.h>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

/// A picture of noise, so that its coded data is long and has stuffed bytes.
std::vector<std::uint8_t> noise_jpeg(int width, int height, int flags) {
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height));
  std::uint32_t state = 1;
  for (std::uint8_t& pixel : pixels) {
    state = state * 1664525U + 1013904223U;
    pixel = static_cast<std::uint8_t>(state >> 24U);
  }
  tjhandle encoder = tjInitCompress();
  unsigned char* out = nullptr;
  unsigned long size = 0;
  EXPECT_EQ(
      tjCompress2(
          encoder, pixels.data(), width, 0, height, TJPF_GRAY, &out, &size, TJSAMP_GRAY, 95, flags),
      0);
  std::vector<std::uint8_t> jpeg(out, out + size);
  tjFree(out);
  (void)tjDestroy(encoder);
  return jpeg;
}

TEST(JpegExtent, FindsTheEndBeforeAStaleTail) {
  for (const int flags : {0, TJFLAG_PROGRESSIVE}) {
    const std::vector<std::uint8_t> jpeg = noise_jpeg(120, 75, flags);
    const std::vector<std::uint8_t> longer = noise_jpeg(200, 200, flags);
    std::vector<std::uint8_t> buffer = longer;
    std::copy(jpeg.begin(), jpeg.end(), buffer.begin());
    const auto extent = find_jpeg_extent(buffer);
    ASSERT_TRUE(extent) << extent.error().message;
    EXPECT_EQ(extent->size_bytes, jpeg.size());
    EXPECT_EQ(extent->width_px, 120);
    EXPECT_EQ(extent->height_px, 75);
  }
}

TEST(JpegExtent, AgreesWithTheLibraryOnTheSize) {
  const std::vector<std::uint8_t> jpeg = noise_jpeg(33, 17, 0);
  const auto extent = find_jpeg_extent(jpeg);
  ASSERT_TRUE(extent);
  tjhandle decoder = tjInitDecompress();
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colorspace = 0;
  ASSERT_EQ(
      tjDecompressHeader3(
          decoder, jpeg.data(), extent->size_bytes, &width, &height, &subsampling, &colorspace),
      0);
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height));
  EXPECT_EQ(tjDecompress2(decoder,
                          jpeg.data(),
                          extent->size_bytes,
                          pixels.data(),
                          width,
                          0,
                          height,
                          TJPF_GRAY,
                          TJFLAG_STOPONWARNING),
            0)
      << tjGetErrorStr2(decoder);
  (void)tjDestroy(decoder);
  EXPECT_EQ(extent->width_px, width);
  EXPECT_EQ(extent->height_px, height);
}

TEST(JpegExtent, RefusesEveryTruncation) {
  const std::vector<std::uint8_t> jpeg = noise_jpeg(16, 16, 0);
  for (std::size_t size = 0; size < jpeg.size(); ++size) {
    const auto extent = find_jpeg_extent(std::span(jpeg).first(size));
    ASSERT_FALSE(extent) << size;
    EXPECT_EQ(extent.error().code, ErrorCode::kCorruptData);
  }
}

TEST(JpegExtent, StepsOverAThumbnailInASegment) {
  const std::vector<std::uint8_t> jpeg = noise_jpeg(64, 48, 0);
  const std::vector<std::uint8_t> thumbnail = noise_jpeg(8, 8, 0);
  std::vector<std::uint8_t> buffer(jpeg.begin(), jpeg.begin() + 2);
  const std::size_t length = thumbnail.size() + 2;
  buffer.insert(buffer.end(),
                {0xFF,
                 0xE1,
                 static_cast<std::uint8_t>(length >> 8U),
                 static_cast<std::uint8_t>(length & 0xFFU)});
  buffer.insert(buffer.end(), thumbnail.begin(), thumbnail.end());
  buffer.insert(buffer.end(), jpeg.begin() + 2, jpeg.end());
  const auto extent = find_jpeg_extent(buffer);
  ASSERT_TRUE(extent) << extent.error().message;
  EXPECT_EQ(extent->size_bytes, buffer.size());
  EXPECT_EQ(extent->width_px, 64);
}

TEST(JpegExtent, RefusesAPictureWithoutPixels) {
  const std::vector<std::uint8_t> empty = {0xFF, 0xD8, 0xFF, 0xD9};
  EXPECT_FALSE(find_jpeg_extent(empty));
  const std::vector<std::uint8_t> other = {'P', 'N', 'G', 0, 0};
  EXPECT_FALSE(find_jpeg_extent(other));
}

}  // namespace
}  // namespace trigmesh
