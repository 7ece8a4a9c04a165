// f_px from FocalLengthIn35mmFilm: CIPA DCG-001-2018 defines the equivalent focal length by the
// *diagonal* angle of view on 36 mm x 24 mm film, so f_px = f35 * diagonal_px / 43.267 mm. Scaling
// by the width (f35 * width / 36) agrees for 3:2 sensors only and is 4 % off for the 4:3 sensors of
// phones and compact cameras. f_px from the focal plane (EXIF 2.32, tags A20E to A210): f_mm *
// sensor pixels per mm * (picture side / sensor side).

#include "sfm/exchange/exif.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string_view>

#include <fmt/format.h>
#include <libexif/exif-data.h>

namespace trigmesh {
namespace {

/// EXIF lies within the first 64 KiB segments of a file; nothing beyond this is looked at.
constexpr std::size_t kMaxBytesScanned = std::size_t{1} << 20U;
constexpr std::size_t kMaxTextLength = 128;
constexpr double kFilmDiagonalMm = 43.266615;
/// Focal lengths outside, in units of the longer side, are typing errors: 170 degrees and 3 degrees
/// of view.
constexpr double kMinFocalRatio = 0.1;
constexpr double kMaxFocalRatio = 20.0;
/// Two sources that differ by more contradict each other; the rounded but simple one is then
/// trusted.
constexpr double kMaxDisagreementRatio = 1.2;
/// Sides of a resized picture keep their ratio up to rounding.
constexpr double kAspectTolerance = 0.02;

struct ExifDataReleaser {
  void operator()(ExifData* data) const { exif_data_unref(data); }
};

/// Looks tags up, whatever block and integer width the camera chose for them.
class ExifTags {
 public:
  explicit ExifTags(ExifData& data) : data_(data), order_(exif_data_get_byte_order(&data)) {}

  [[nodiscard]] std::string text(ExifTag tag) const {
    const ExifEntry* entry = find(tag);
    if (entry == nullptr || entry->format != EXIF_FORMAT_ASCII) {
      return {};
    }
    std::string value;
    for (unsigned int i = 0;
         i < entry->size && value.size() < kMaxTextLength && entry->data[i] != 0;
         ++i) {
      value +=
          entry->data[i] >= 0x20 && entry->data[i] < 0x7F ? static_cast<char>(entry->data[i]) : ' ';
    }
    const std::size_t begin = value.find_first_not_of(' ');
    return begin == std::string::npos
               ? std::string()
               : value.substr(begin, value.find_last_not_of(' ') - begin + 1);
  }

  /// 0 when absent, not finite or negative.
  [[nodiscard]] double number(ExifTag tag) const {
    const ExifEntry* entry = find(tag);
    if (entry == nullptr || entry->components < 1 ||
        entry->size < exif_format_get_size(entry->format)) {
      return 0.0;
    }
    switch (entry->format) {
      case EXIF_FORMAT_SHORT:
        return static_cast<double>(exif_get_short(entry->data, order_));
      case EXIF_FORMAT_LONG:
        return static_cast<double>(exif_get_long(entry->data, order_));
      case EXIF_FORMAT_RATIONAL: {
        const ExifRational value = exif_get_rational(entry->data, order_);
        return value.denominator == 0 ? 0.0
                                      : static_cast<double>(value.numerator) / value.denominator;
      }
      default:
        return 0.0;
    }
  }

 private:
  [[nodiscard]] const ExifEntry* find(ExifTag tag) const {
    for (const ExifIfd ifd : {EXIF_IFD_EXIF, EXIF_IFD_0}) {
      const ExifEntry* entry = exif_content_get_entry(data_.ifd[ifd], tag);
      if (entry != nullptr && entry->data != nullptr) {
        return entry;
      }
    }
    return nullptr;
  }

  ExifData& data_;
  ExifByteOrder order_;
};

/// Millimetres per FocalPlaneResolutionUnit; 0 when unknown.
double millimetres_per_unit(double code) {
  // 0: absent, the default is the inch; 1: "no unit", written by cameras that mean the inch.
  constexpr std::array<double, 6> kMillimetres = {25.4, 25.4, 25.4, 10.0, 1.0, 0.001};
  for (std::size_t i = 0; i < kMillimetres.size(); ++i) {
    if (code == static_cast<double>(i)) {
      return kMillimetres[i];
    }
  }
  return 0.0;
}

bool is_plausible(double focal_px, double long_side_px) {
  return std::isfinite(focal_px) && focal_px >= kMinFocalRatio * long_side_px &&
         focal_px <= kMaxFocalRatio * long_side_px;
}

/// Sides sorted, so that a picture turned upright by software is compared rightly.
struct PictureSize {
  double long_px = 0.0;
  double short_px = 0.0;
};

PictureSize sorted_size(double a, double b) {
  return {std::max(a, b), std::min(a, b)};
}

double focal_from_plane(const ExifTags& tags, double focal_mm, const PictureSize& picture) {
  const double resolution = tags.number(EXIF_TAG_FOCAL_PLANE_X_RESOLUTION);
  const double unit_mm = millimetres_per_unit(tags.number(EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT));
  if (focal_mm <= 0.0 || resolution <= 0.0 || unit_mm <= 0.0) {
    return 0.0;
  }
  const double focal_sensor_px = focal_mm * resolution / unit_mm;
  const PictureSize taken =
      sorted_size(tags.number(EXIF_TAG_PIXEL_X_DIMENSION), tags.number(EXIF_TAG_PIXEL_Y_DIMENSION));
  if (taken.short_px <= 0.0) {
    return focal_sensor_px;
  }
  const double scale = picture.long_px / taken.long_px;
  const bool is_cropped =
      std::abs(picture.short_px / taken.short_px - scale) > kAspectTolerance * scale;
  return is_cropped ? 0.0 : focal_sensor_px * scale;
}

void derive_focal(const ExifTags& tags, const PictureSize& picture, ExifCamera& camera) {
  const double from_plane = focal_from_plane(tags, camera.focal_length_mm, picture);
  const double from_film = tags.number(EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM) *
                           std::hypot(picture.long_px, picture.short_px) / kFilmDiagonalMm;
  const bool plane_ok = is_plausible(from_plane, picture.long_px);
  const bool film_ok = is_plausible(from_film, picture.long_px);
  const bool contradict =
      plane_ok && film_ok &&
      std::max(from_plane, from_film) > kMaxDisagreementRatio * std::min(from_plane, from_film);
  if (plane_ok && !contradict) {
    camera.focal_px = from_plane;
    camera.focal_source = ExifFocalSource::kFocalPlane;
  } else if (film_ok) {
    camera.focal_px = from_film;
    camera.focal_source = ExifFocalSource::kEquivalent35mm;
  }
}

}  // namespace

std::string ExifCamera::group_key() const {
  return fmt::format("{}|{}|{}|{}|{:.3f}", make, model, serial, lens, focal_length_mm);
}

std::optional<ExifCamera> read_exif_camera(std::span<const std::uint8_t> jpeg,
                                           int width_px,
                                           int height_px) {
  const std::unique_ptr<ExifData, ExifDataReleaser> data(exif_data_new());
  if (data == nullptr || jpeg.empty() || width_px <= 0 || height_px <= 0) {
    return std::nullopt;
  }
  // Take tags as they are: libexif would otherwise add and convert what it thinks the standard
  // wants.
  exif_data_unset_option(data.get(), EXIF_DATA_OPTION_FOLLOW_SPECIFICATION);
  exif_data_load_data(
      data.get(), jpeg.data(), static_cast<unsigned int>(std::min(jpeg.size(), kMaxBytesScanned)));
  constexpr auto kBodySerialNumber = static_cast<ExifTag>(0xA431);
  constexpr auto kLensModel = static_cast<ExifTag>(0xA434);
  const ExifTags tags(*data);
  ExifCamera camera;
  camera.make = tags.text(EXIF_TAG_MAKE);
  camera.model = tags.text(EXIF_TAG_MODEL);
  camera.serial = tags.text(kBodySerialNumber);
  camera.lens = tags.text(kLensModel);
  camera.focal_length_mm = tags.number(EXIF_TAG_FOCAL_LENGTH);
  derive_focal(tags, sorted_size(width_px, height_px), camera);
  const bool says_nothing = camera.make.empty() && camera.model.empty() && camera.serial.empty() &&
                            camera.lens.empty() && camera.focal_length_mm <= 0.0 &&
                            !camera.focal_px;
  return says_nothing ? std::nullopt : std::optional<ExifCamera>(std::move(camera));
}

}  // namespace trigmesh
