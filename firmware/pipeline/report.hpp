#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/pipeline/report_sections.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/matching/matches.hpp"
#include "sfm/scene/outcome.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// How the intrinsics of a camera group came about.
enum class IntrinsicsOrigin {
  kGiven,         ///< from a profile, kept as it was
  kPriorRefined,  ///< started at the focal length in the photograph's EXIF record, refined
  kSolved,        ///< nothing was known
};

/// How much the reader has to care about a note.
enum class NoteSeverity { kInfo, kWarning, kError };

/// The one answer on top of the report.
enum class Verdict {
  kComplete,  ///< every image is registered in one model
  kPartial,   ///< a model of at least half of the images; the others are named with their reasons
  kNotReady,  ///< no model, or one of fewer than half of the images: shoot again
};

/// "given", "prior_refined", "solved".
[[nodiscard]] std::string_view to_string(IntrinsicsOrigin origin);
/// "info", "warning", "error".
[[nodiscard]] std::string_view to_string(NoteSeverity severity);
/// "complete", "partial", "not_ready".
[[nodiscard]] std::string_view to_string(Verdict verdict);

/// A remark of the pipeline for the reader, one sentence.
struct ReportNote {
  NoteSeverity severity = NoteSeverity::kInfo;
  std::string text;
};

/// One setting as it was used, already in words.
struct ReportSetting {
  std::string name;
  std::string value;
};

/// What matching and verification said about two images.
struct PairEvidence {
  ImagePair pair;  ///< positions in ReportInput::images
  TwoViewKind kind = TwoViewKind::kNone;
  std::size_t candidates = 0;  ///< putative matches
  std::size_t inliers = 0;     ///< of these, agreeing with the two-view geometry
};

/// Counts in bins of equal width: bin i holds [start + i width, start + (i + 1) width). The last
/// bin also holds everything above. Values below `start` do not occur.
struct Histogram {
  double start = 0.0;
  double bin_width = 1.0;
  std::vector<std::size_t> counts;
};

/// Everything that build_report reads; the spans are borrowed for the call only. None of the
/// strings may hold a clock time, a duration or an absolute path: the report must not differ
/// between two runs on the same input.
struct ReportInput {
  std::span<const Scene>
      components;  ///< models without a link between them, main first; may be empty
  std::span<const ImageOutcome>
      images;  ///< in input order; views of the components are found by name
  std::span<const PairEvidence> pairs;
  std::span<const VideoFrameSection> frames;  ///< of a video, in order of time; empty: no video
  std::span<const IntrinsicsOrigin>
      intrinsics_origins;  ///< per camera group; kSolved where the span ends early
  std::vector<ReportSetting> settings;
  std::vector<ReportNote> notes;
  std::string software_version;
  std::string input_description;        ///< e.g. "folder fountain, 11 photographs"
  std::span<const ScaleSection> scale;  ///< per component; empty: nobody knew a length
  std::optional<DenseSection> dense;    ///< of the main component, like the next four
  std::optional<MovingSection> moving;
  std::optional<SurfaceSection> surface;
  std::optional<TextureSection> texture;
  std::optional<FinishSection> finish;
};

/// One model: the images that are linked with each other.
struct ComponentReport {
  std::size_t registered_images = 0;
  std::size_t points = 0;
  std::size_t observations = 0;
  double mean_track_length = 0.0;  ///< observations per point
  double rmse_px = 0.0;            ///< root mean square of the reprojection errors
  double median_error_px = 0.0;
  double mean_error_px = 0.0;
};

/// One camera group as one component sees it; groups without a registered image there are left out.
struct CameraReport {
  std::size_t component = 0;
  std::size_t group = 0;  ///< position in Scene::cameras
  Camera camera;
  IntrinsicsOrigin origin = IntrinsicsOrigin::kSolved;
  std::size_t images = 0;              ///< registered images of the group in the component
  double focal_35mm_equivalent = 0.0;  ///< mm, by the diagonal of the frame (43.27 mm)
  double horizontal_fov_deg =
      0.0;  ///< of the undistorted pinhole; for the fisheye 2 atan is replaced by width / fx
};

/// One row of the image table.
struct ImageReport {
  std::string name;
  RefusalReason reason = RefusalReason::kNone;
  std::string detail;
  std::string advice;
  std::size_t features = 0;
  std::size_t overlapping_images = 0;
  std::size_t map_matches = 0;
  std::size_t map_inliers = 0;
  std::size_t observations = 0;
  double rmse_px = 0.0;
  std::optional<std::size_t> component;  ///< which model holds its pose
  std::optional<std::size_t> group;      ///< its camera group, when it has a pose
};

/// Everything that the report shows: plain data, a pure function of its input.
struct ReconstructionReport {
  std::string software_version;
  std::string input_description;
  Verdict verdict = Verdict::kNotReady;
  std::string verdict_sentence;
  std::string units_sentence;
  std::optional<double> metres_per_unit;  ///< 1 when the main component is in metres
  std::size_t images_total = 0;
  std::size_t images_registered = 0;  ///< with a pose in the main component
  std::size_t images_in_other_components = 0;
  std::size_t images_refused = 0;  ///< without any pose
  ComponentReport overall;         ///< all components together
  std::vector<ComponentReport> components;
  std::vector<CameraReport> cameras;
  std::vector<ImageReport> images;        ///< input order
  std::vector<VideoFrameSection> frames;  ///< all of the video; empty: photographs
  std::vector<PairEvidence> pairs;        ///< sorted by pair
  Histogram reprojection_error_px;
  Histogram track_length;             ///< images per point
  Histogram triangulation_angle_deg;  ///< per point: the largest angle between two of its rays
  std::vector<ScaleSection> scale;    ///< per component; empty: nobody knew a length
  std::optional<DenseSection> dense;
  std::optional<MovingSection> moving;
  std::optional<SurfaceSection> surface;
  std::optional<TextureSection> texture;
  std::optional<FinishSection> finish;
  std::vector<ReportSetting> settings;
  std::vector<ReportNote>
      notes;  ///< errors first, then warnings, then infos; otherwise in the given order
};

/// Sums up a reconstruction. The scenes must be consistent (Scene::validate); observations that do
/// not project (point behind the camera) count as observations but have no reprojection error.
/// O(observations + sum of squared track lengths).
[[nodiscard]] ReconstructionReport build_report(const ReportInput& input);

}  // namespace trigmesh
