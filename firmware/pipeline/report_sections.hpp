#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "sfm/coverage/gap_kind.hpp"
#include "sfm/keyframes/frame_verdict.hpp"
#include "sfm/scale/metric_scale.hpp"

namespace trigmesh {

// What the stages before and after mapping came to, for the report. Plain data, filled by the
// pipeline; the sections that are missing are not shown. Lengths are in scene units, areas in their
// squares.

/// How a frame was mapped while it was captured.
struct LiveMapping {
  std::string following;    ///< "waiting", "tracked", "lost"
  double duration_s = 0.0;  ///< of the mapping
  std::size_t waiting = 0;  ///< frames that waited to be mapped, then
};

/// A frame of the video from which the photographs were chosen.
struct VideoFrameSection {
  std::string name;
  double time_s = 0.0;  ///< since the first frame
  FrameVerdict verdict = FrameVerdict::kKept;
  FrameMeasures measures{};
  std::optional<LiveMapping> live{};  ///< kept ones of a capture that was mapped while it went on
};

/// A marker as the views of a model see it.
struct MarkerSection {
  int id = 0;
  SquareOutcome outcome = SquareOutcome::kOk;
  std::size_t views_seen = 0;
  std::size_t views_used = 0;
  double rms_px = 0.0;  ///< of its corners; kOk only
};

/// What fixed the unit of a model, where somebody knew a length.
struct ScaleSection {
  ScaleOutcome outcome = ScaleOutcome::kNothingMeasured;  ///< kOk: lengths of the model are metres
  double metres_per_unit = 0.0;  ///< of the unit that mapping had chosen; kOk only, as the next
  double sd_ratio = 0.0;         ///< standard deviation of the scale, as a part of it
  std::vector<LengthEvidence> lengths{};  ///< in the unit that mapping had chosen
  std::vector<MarkerSection> markers{};   ///< of which a length is known, by number
  std::string problem{};                  ///< why there is no scale, one sentence; else empty
  bool z_is_up = false;                   ///< origin and axes are those of the card, z up
  double up_sd_deg = 0.0;                 ///< standard deviation of up about one axis
  std::string up_problem{};               ///< why there is no up although it was asked for
};

/// Depth maps and the cloud that was made of them.
struct DenseSection {
  std::size_t views = 0;  ///< with a depth map
  int map_width_px = 0;   ///< of the largest map
  int map_height_px = 0;
  double filled_ratio = 0.0;   ///< pixels with a depth among all, mean over the maps, [0, 1]
  std::size_t points = 0;      ///< of dense.ply
  double mean_view_count = 0;  ///< views that agree on a point
  std::vector<std::string> lowered{};  ///< quality steps taken to keep a limit, one sentence each
};

/// A border of the surface that was left open.
struct OpenHole {
  Eigen::Vector3d center_in_world = Eigen::Vector3d::Zero();
  double perimeter = 0.0;
};

/// A photograph in which something moved.
struct MovingImage {
  std::string name;
  double masked_ratio = 0.0;  ///< pixels of its mask, of all, (0, 1]
};

/// What was found to have moved between the photographs, and is left out of what follows.
struct MovingSection {
  std::vector<MovingImage> images{};  ///< with a mask, in the order of the views
  double masked_ratio = 0.0;          ///< pixels of masks, mean over all views, [0, 1]
};

/// The triangle mesh.
struct SurfaceSection {
  std::size_t vertices = 0;
  std::size_t faces = 0;
  std::size_t components = 0;          ///< pieces that hang together
  double area = 0.0;                   ///< of all faces
  std::optional<double> seen_ratio{};  ///< area that at least two views see, of all, [0, 1]
  std::size_t holes_filled = 0;
  std::size_t holes_open = 0;             ///< outer borders of an open surface count as one
  std::vector<OpenHole> largest_holes{};  ///< the largest first; as many as are worth telling
  std::vector<std::string> lowered{};
};

/// A place where the surface is open or weak, and from where to shoot it.
struct FinishGap {
  GapKind kind = GapKind::kHole;
  Eigen::Vector3d center_in_world = Eigen::Vector3d::Zero();
  double area_ratio = 0.0;     ///< of the whole area, with what is missing
  std::string photograph;      ///< taken from most nearly the right place
  double turn_left_deg = 0.0;  ///< from there around the gap; to the right < 0
  double rise_deg = 0.0;  ///< above the horizon of the gap, more than that photograph; < 0 lower
  std::string advice;     ///< all of it in a sentence
};

/// Whether the thing is shot, or what is missing.
struct FinishSection {
  bool ready = false;
  std::string sentence;
  double gap_ratio = 0.0;         ///< area of all gaps that photographs would close, likewise
  std::vector<FinishGap> gaps{};  ///< the largest first; as many as are worth telling
};

/// The pictures on the mesh.
struct TextureSection {
  std::size_t views_used = 0;  ///< views that gave a face its picture
  std::size_t charts = 0;
  std::size_t pages = 0;
  int page_size_px = 0;
  double textured_ratio = 0.0;      ///< area with a picture, of all, [0, 1]
  std::size_t held_out_views = 0;   ///< left out of texturing, compared with renderings
  std::optional<double> psnr_db{};  ///< over covered pixels of the held-out views
  std::optional<double> ssim{};     ///< the same
  std::vector<std::string> lowered{};
};

}  // namespace trigmesh
