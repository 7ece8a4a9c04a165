#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace trigmesh {

/// Where a focal length in pixels comes from, the more precise first.
enum class ExifFocalSource {
  kNone,            ///< EXIF does not tell it, or tells something impossible
  kFocalPlane,      ///< FocalLength and FocalPlaneXResolution: the size of a sensor pixel is known
  kEquivalent35mm,  ///< FocalLengthIn35mmFilm: a whole number of millimetres, so 1 to 3 % coarse
};

/// What a photograph says about the camera that took it.
struct ExifCamera {
  std::string make;  ///< trimmed; empty when absent
  std::string model;
  std::string serial;            ///< of the body
  std::string lens;              ///< model of the lens
  double focal_length_mm = 0.0;  ///< 0 when absent
  /// Focal length in pixels of the stored picture; absent when it cannot be derived.
  std::optional<double> focal_px;
  ExifFocalSource focal_source = ExifFocalSource::kNone;

  /// Equal for pictures that can share one set of intrinsics as far as EXIF tells: camera, lens,
  /// focal length. (Picture size is not part of it: the caller adds it.)
  [[nodiscard]] std::string group_key() const;
};

/// Reads the EXIF block of a JPEG whose decoded size is `width_px` x `height_px` (both > 0).
/// Nothing when there is no EXIF; broken EXIF is treated as absent: it is a hint, not a condition.
/// A resized picture is recognised by the pixel dimensions that EXIF recorded; a cropped one
/// (another aspect ratio) gets no focal length from the focal plane.
[[nodiscard]] std::optional<ExifCamera> read_exif_camera(std::span<const std::uint8_t> jpeg,
                                                         int width_px,
                                                         int height_px);

}  // namespace trigmesh
