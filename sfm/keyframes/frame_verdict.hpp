#pragma once

#include <cstdint>
#include <string_view>

namespace trigmesh {

/// What became of a frame of a video. The list is closed.
enum class FrameVerdict : std::uint8_t {
  kKept,             ///< a keyframe
  kBlurred,          ///< a sharper frame of the same stretch was kept, or it is much less sharp
                     ///< than the frames around it
  kTooLittleMotion,  ///< shows what the last keyframe shows, from the same place
  kTooFast,          ///< the camera turned or moved too far since the frame before
  kExposureJump,     ///< much darker or brighter than the frames before
  kDuplicate,        ///< the camera gave the same picture again
  kTrackLost,        ///< nothing of the last keyframe is recognised any more
  kOverBudget,       ///< would do, but the last keyframe is too recent
};

/// "kept", "blurred", "too little motion", ...: for reports and journals; stable.
[[nodiscard]] std::string_view to_string(FrameVerdict verdict);

/// The numbers on which a verdict rests.
struct FrameMeasures {
  /// Variance of the Laplacian at the reduced size, grey levels squared; compares with frames of
  /// the same scene only.
  double sharpness = 0.0;
  double relative_sharpness = 1.0;  ///< to what is usual of late
  double brightness = 0.0;          ///< mean grey level, 0..255
  /// Median angle between the rays to the same corner in the last keyframe and here, degrees.
  double motion_deg = 0.0;
  /// What is left of it after the rotation that explains most of it, degrees: at least this much is
  /// due to a change of place.
  double parallax_deg = 0.0;
  double overlap = 1.0;  ///< share of the last keyframe's corners that are still followed

  bool operator==(const FrameMeasures&) const = default;
};

}  // namespace trigmesh
