#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"

namespace trigmesh {

/// A calibrated camera as it is kept in a file (TOML):
///
///     format = 1
///     name = "left"                # optional
///     serial = "A1B2"              # optional
///     model = "brown_conrady"      # pinhole, radial, brown_conrady, kannala_brandt
///     width_px = 640
///     height_px = 480
///     fx_px = 533.1
///     fy_px = 533.2
///     cx_px = 341.9                # first pixel centre = (0, 0)
///     cy_px = 233.3
///     distortion = [-0.28, 0.04, 0.001, -0.0002]   # as many as the model has; left out for
///     pinhole rms_px = 0.21                # optional: reprojection error of the calibration
///
/// There is no date in it: the same calibration gives the same bytes.
struct CameraProfile {
  Camera camera;
  std::string name;              ///< for people; at most 128 bytes
  std::string serial;            ///< ties the profile to a device; at most 128 bytes
  std::optional<double> rms_px;  ///< >= 0

  bool operator==(const CameraProfile&) const = default;
};

/// Reads one profile. `file` is for messages. kCorruptData with file, line and reason: not TOML,
/// unknown or missing key, wrong type, value out of range; kUnsupported: another format number;
/// kLimitExceeded: more than 64 KiB.
[[nodiscard]] Result<CameraProfile> parse_camera_profile(std::string_view text,
                                                         std::string_view file);

/// The text that parse_camera_profile reads back to an equal profile, bit for bit.
/// kInvalidArgument: invalid camera.
[[nodiscard]] Result<std::string> format_camera_profile(const CameraProfile& profile);

/// Reads what `--camera` names: a profile of ours, or a COLMAP cameras.txt (one or several cameras,
/// pixel centres moved from (0.5, 0.5) to (0, 0)). Told apart by the first line that is not a
/// comment. At least one camera in the result.
[[nodiscard]] Result<std::vector<CameraProfile>> parse_camera_file(std::string_view text,
                                                                   std::string_view file);

/// The same from a file; in addition kNotFound, kIo, kLimitExceeded.
[[nodiscard]] Result<std::vector<CameraProfile>> read_camera_file(
    const std::filesystem::path& path);

}  // namespace trigmesh
