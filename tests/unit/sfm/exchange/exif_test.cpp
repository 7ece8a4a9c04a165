#include "sfm/exchange/exif.hpp"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <libexif/exif-data.h>

namespace trigmesh {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Builds an EXIF block tag by tag with libexif's writer.
class ExifBuilder {
 public:
  ExifBuilder() : data_(exif_data_new()) {
    exif_data_unset_option(data_, EXIF_DATA_OPTION_FOLLOW_SPECIFICATION);
    exif_data_set_byte_order(data_, EXIF_BYTE_ORDER_INTEL);
  }

  ExifBuilder(const ExifBuilder&) = delete;
  ExifBuilder& operator=(const ExifBuilder&) = delete;
  ExifBuilder(ExifBuilder&&) = delete;
  ExifBuilder& operator=(ExifBuilder&&) = delete;

  ~ExifBuilder() { exif_data_unref(data_); }

  ExifBuilder& text(ExifIfd ifd, int tag, const std::string& value) {
    ExifEntry* entry = add(ifd, tag, EXIF_FORMAT_ASCII, value.size() + 1, value.size() + 1);
    std::memcpy(entry->data, value.c_str(), value.size() + 1);
    return *this;
  }

  ExifBuilder& whole(int tag, std::uint16_t value) {
    exif_set_short(
        add(EXIF_IFD_EXIF, tag, EXIF_FORMAT_SHORT, 1, 2)->data, EXIF_BYTE_ORDER_INTEL, value);
    return *this;
  }

  ExifBuilder& ratio(int tag, std::uint32_t numerator, std::uint32_t denominator) {
    exif_set_rational(add(EXIF_IFD_EXIF, tag, EXIF_FORMAT_RATIONAL, 1, 8)->data,
                      EXIF_BYTE_ORDER_INTEL,
                      ExifRational{numerator, denominator});
    return *this;
  }

  /// A JPEG that ends after its EXIF segment: enough for a reader of EXIF.
  [[nodiscard]] Bytes jpeg() const {
    unsigned char* block = nullptr;
    unsigned int size = 0;
    exif_data_save_data(data_, &block, &size);
    const std::size_t length = size + 2U;
    const auto high = static_cast<std::uint8_t>(length >> 8U);
    const auto low = static_cast<std::uint8_t>(length & 0xFFU);
    Bytes bytes;
    bytes.reserve(length + 6U);
    for (const std::uint8_t byte : {std::uint8_t{0xFF},
                                    std::uint8_t{0xD8},
                                    std::uint8_t{0xFF},
                                    std::uint8_t{0xE1},
                                    high,
                                    low}) {
      bytes.push_back(byte);
    }
    bytes.insert(bytes.end(), block, block + size);
    bytes.push_back(0xFF);
    bytes.push_back(0xD9);
    std::free(block);
    return bytes;
  }

 private:
  ExifEntry* add(
      ExifIfd ifd, int tag, ExifFormat format, std::size_t components, std::size_t size) {
    ExifMem* memory = exif_mem_new_default();
    ExifEntry* entry = exif_entry_new_mem(memory);
    entry->data = static_cast<unsigned char*>(exif_mem_alloc(memory, static_cast<ExifLong>(size)));
    entry->size = static_cast<unsigned int>(size);
    entry->components = components;
    entry->format = format;
    entry->tag = static_cast<ExifTag>(tag);
    exif_content_add_entry(data_->ifd[ifd], entry);
    exif_mem_unref(memory);
    exif_entry_unref(entry);
    return entry;
  }

  ExifData* data_;
};

constexpr int kBodySerialNumber = 0xA431;
constexpr int kFocal35 = EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM;

TEST(Exif, EquivalentFocalLengthScalesWithTheDiagonal) {
  const auto camera = read_exif_camera(ExifBuilder().whole(kFocal35, 28).jpeg(), 4000, 3000);
  ASSERT_TRUE(camera);
  ASSERT_TRUE(camera->focal_px);
  EXPECT_NEAR(*camera->focal_px, 28.0 * 5000.0 / std::hypot(36.0, 24.0), 0.01);
  EXPECT_EQ(camera->focal_source, ExifFocalSource::kEquivalent35mm);
}

// A camera with 5.6 um pixels and a 35 mm lens has f = 6250 sensor pixels.
ExifBuilder& add_focal_plane(ExifBuilder& builder) {
  return builder.ratio(EXIF_TAG_FOCAL_LENGTH, 35, 1)
      .ratio(EXIF_TAG_FOCAL_PLANE_X_RESOLUTION, 10'000'000, 2205)  // pixels an inch
      .whole(EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT, 2)
      .whole(EXIF_TAG_PIXEL_X_DIMENSION, 6000)
      .whole(EXIF_TAG_PIXEL_Y_DIMENSION, 4000);
}

TEST(Exif, FocalPlaneGivesPixelsOfTheSensor) {
  ExifBuilder builder;
  const auto camera = read_exif_camera(add_focal_plane(builder).jpeg(), 6000, 4000);
  ASSERT_TRUE(camera);
  ASSERT_TRUE(camera->focal_px);
  EXPECT_NEAR(*camera->focal_px, 6250.0, 10.0);
  EXPECT_EQ(camera->focal_source, ExifFocalSource::kFocalPlane);
}

TEST(Exif, FocalPlaneFollowsAResizedOrTurnedPicture) {
  ExifBuilder builder;
  const Bytes bytes = add_focal_plane(builder).jpeg();
  EXPECT_NEAR(read_exif_camera(bytes, 1500, 1000)->focal_px.value(), 6250.0 / 4.0, 3.0);
  EXPECT_NEAR(read_exif_camera(bytes, 1000, 1500)->focal_px.value(), 6250.0 / 4.0, 3.0);
}

TEST(Exif, CroppedPictureGetsNoFocalLengthFromThePlane) {
  ExifBuilder builder;
  const auto camera = read_exif_camera(add_focal_plane(builder).jpeg(), 1000, 1000);
  ASSERT_TRUE(camera);
  EXPECT_FALSE(camera->focal_px);
  EXPECT_DOUBLE_EQ(camera->focal_length_mm, 35.0);
}

TEST(Exif, TrustsTheFilmEquivalentWhenTheSourcesContradict) {
  ExifBuilder builder;
  const auto camera =
      read_exif_camera(add_focal_plane(builder).whole(kFocal35, 20).jpeg(), 6000, 4000);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->focal_source, ExifFocalSource::kEquivalent35mm);
}

TEST(Exif, IgnoresImpossibleFocalLengths) {
  EXPECT_FALSE(read_exif_camera(ExifBuilder().whole(kFocal35, 0).jpeg(), 4000, 3000));
  EXPECT_FALSE(read_exif_camera(ExifBuilder().whole(kFocal35, 60000).jpeg(), 4000, 3000));
  const auto zero_denominator =
      read_exif_camera(ExifBuilder().ratio(EXIF_TAG_FOCAL_LENGTH, 35, 0).jpeg(), 4000, 3000);
  EXPECT_FALSE(zero_denominator);
}

TEST(Exif, IgnoresAnUnknownResolutionUnit) {
  ExifBuilder builder;
  builder.ratio(EXIF_TAG_FOCAL_LENGTH, 35, 1).ratio(EXIF_TAG_FOCAL_PLANE_X_RESOLUTION, 4000, 1);
  builder.ratio(
      EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT, 2'684'490'000, 1);  // found by fuzzing: beyond any int
  const auto camera = read_exif_camera(builder.jpeg(), 6000, 4000);
  ASSERT_TRUE(camera);
  EXPECT_FALSE(camera->focal_px);
}

TEST(Exif, TellsCamerasApart) {
  const auto identity = [](const char* model, const char* serial) {
    return read_exif_camera(ExifBuilder()
                                .text(EXIF_IFD_0, EXIF_TAG_MAKE, "Maker  ")
                                .text(EXIF_IFD_0, EXIF_TAG_MODEL, model)
                                .text(EXIF_IFD_EXIF, kBodySerialNumber, serial)
                                .jpeg(),
                            100,
                            100)
        .value();
  };
  EXPECT_EQ(identity("A", "1").make, "Maker");
  EXPECT_EQ(identity("A", "1").serial, "1");
  EXPECT_EQ(identity("A", "1").group_key(), identity("A", "1").group_key());
  EXPECT_NE(identity("A", "1").group_key(), identity("B", "1").group_key());
  EXPECT_NE(identity("A", "1").group_key(), identity("A", "2").group_key());
}

TEST(Exif, IsAbsentInOtherBytesAndSurvivesTruncation) {
  EXPECT_FALSE(read_exif_camera({}, 10, 10));
  const Bytes noise(500, 0x5A);
  EXPECT_FALSE(read_exif_camera(noise, 10, 10));
  ExifBuilder builder;
  const Bytes whole = add_focal_plane(builder).jpeg();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    (void)read_exif_camera(
        std::span(whole).first(size), 100, 100);  // must not crash; what it finds does not matter
  }
}

}  // namespace
}  // namespace trigmesh
