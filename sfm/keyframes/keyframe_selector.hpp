#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/keyframes/corner_tracker.hpp"
#include "sfm/keyframes/frame_verdict.hpp"
#include "sfm/keyframes/image_pyramid.hpp"
#include "sfm/keyframes/view_change.hpp"

namespace trigmesh {

/// Which frames of a video become keyframes. Angles are those of the camera's rays.
struct KeyframeOptions {
  /// Longer side of the image that is looked at, pixels, [64, 2000].
  int image_side_px = 320;
  /// Focal length over the longer side of the image, [0.2, 10]; 1 is a field of view of 53 degrees.
  double focal_ratio = 1.0;
  /// From this median motion on a frame may be kept, degrees, (0, 30].
  double min_motion_deg = 1.5;
  /// So much motion ends a stretch, and the sharpest of it is kept, degrees, > min_motion_deg.
  double max_motion_deg = 4.0;
  /// After so long a little motion is enough (slow_motion_deg): walking slowly is good practice. >
  /// 0.
  std::chrono::milliseconds slow_interval{400};
  double slow_motion_deg = 0.4;  ///< (0, min_motion_deg]
  /// From this overlap down a frame may be kept, (0, 1).
  double max_overlap = 0.7;
  /// Below this overlap a stretch ends, (0, max_overlap).
  double min_overlap = 0.5;
  /// Below this overlap nothing connects the frame with the last keyframe, (0, min_overlap).
  double lost_overlap = 0.15;
  /// Longest stretch from which one frame is kept. > 0.
  std::chrono::milliseconds stretch{200};
  /// When even the sharpest frame of a stretch is one of the blurriest of late, sharper ones are
  /// looked for so long before it and after it. >= 0.
  std::chrono::milliseconds patience{300};
  /// Keyframes follow each other no quicker than this, unless only blurrier frames follow. >= 0.
  std::chrono::milliseconds min_interval{60};
  /// Less sharp than this share of what is usual of late: blurred. [0, 1).
  double min_relative_sharpness = 0.4;
  /// More corners lost than this share between two frames: too fast. (0, 1).
  double max_step_loss = 0.6;
  /// Brighter or darker than the last frames by this factor: a jump. > 1.
  double max_brightness_ratio = 1.6;
  /// At most so many frames wait for a decision; when they are there, those from before the stretch
  /// are decided early, then the stretch ends. [2, 10000].
  std::size_t max_waiting = 256;
  CornerTrackerOptions tracker;

  [[nodiscard]] Result<> validate() const;
};

/// KeyframeOptions::focal_ratio of a lens, held within what is allowed.
[[nodiscard]] double focal_ratio_of(double focal_px, int longer_side_px);

/// A frame as the selector looks at it.
struct VideoFrame {
  std::uint64_t id = 0;                  ///< the caller's; comes back in the decision
  std::chrono::nanoseconds timestamp{};  ///< rises
  cv::Mat grey;                          ///< CV_8UC1, any size, the same for all frames; copied
};

struct FrameDecision {
  std::uint64_t id = 0;
  FrameVerdict verdict = FrameVerdict::kKept;
  FrameMeasures measures;
};

/// Keeps the sharpest frame of each stretch of a video with enough motion and overlap, and says why
/// the others were not kept. Corners of the last keyframe are followed from frame to frame; a
/// stretch begins with the first frame that has moved far enough and ends by motion, overlap or
/// time, or by `max_waiting`. Every frame gets exactly one decision, at the latest when its stretch
/// ends. Deterministic,
/// thread-compatible. Holds the reduced images of one stretch; once memory for them is there, only
/// a keyframe takes more. Used as
///
///     for (..) { for (const FrameDecision& decision : selector.offer(frame)) { .. } }
///     for (const FrameDecision& decision : selector.finish()) { .. }
class KeyframeSelector {
 public:
  /// kInvalidArgument: options.
  [[nodiscard]] static Result<KeyframeSelector> create(const KeyframeOptions& options);

  /// Decisions in the order in which they became certain; valid until the next call.
  [[nodiscard]] std::span<const FrameDecision> offer(const VideoFrame& frame);

  /// The end of the video: decides what is left, and begins anew. Valid until the next call.
  [[nodiscard]] std::span<const FrameDecision> finish();

 private:
  /// A frame of the stretch or shortly before it, which may still become the keyframe.
  struct Candidate {
    std::uint64_t id = 0;
    std::chrono::nanoseconds timestamp{};
    std::shared_ptr<const ImagePyramid> pyramid;
    FrameMeasures measures;
    /// It has moved far enough, or is the first of all. The others are taken only for want of a
    /// sharp one.
    bool is_wanted = false;
    FrameVerdict refusal = FrameVerdict::kTooLittleMotion;  ///< if another one is kept
  };

  explicit KeyframeSelector(const KeyframeOptions& options) : options_(options) {}

  [[nodiscard]] Candidate look_at(const VideoFrame& frame);
  void judge(Candidate candidate);
  void place(Candidate candidate);
  void place_without_reference(Candidate candidate);
  void extend_stretch(Candidate candidate);
  void lose_track(Candidate candidate);
  void follow_corners(const std::shared_ptr<const ImagePyramid>& pyramid);
  void measure_motion(FrameMeasures& measures);
  [[nodiscard]] bool has_moved(const Candidate& candidate) const;
  [[nodiscard]] bool ends_stretch(const FrameMeasures& measures) const;
  void forget_early_frames();
  [[nodiscard]] bool is_full() const;
  [[nodiscard]] bool may_wait(const FrameMeasures& measures) const;
  [[nodiscard]] std::size_t sharpest_wanted() const;
  [[nodiscard]] std::size_t choose_keyframe() const;
  [[nodiscard]] bool is_blurry(double sharpness) const;
  void close_stretch();
  [[nodiscard]] bool start_from(const Candidate& keyframe);
  void decide(const Candidate& candidate, FrameVerdict verdict);
  [[nodiscard]] Eigen::Vector3d ray_of(const Eigen::Vector2f& pixel) const;

  KeyframeOptions options_;
  cv::Size image_size_;
  PyramidPool pyramids_;
  std::shared_ptr<const ImagePyramid> last_pyramid_;  ///< of the last frame that was followed
  std::vector<double> last_sharpness_;
  std::vector<double> last_brightness_;
  ViewChangeMeter view_change_;
  std::optional<std::chrono::nanoseconds> keyframe_time_;
  std::vector<Eigen::Vector2f> reference_;  ///< corners in the last keyframe
  /// Where they are in the last frame; nothing: lost for good.
  std::vector<std::optional<Eigen::Vector2f>> corners_;
  int stepped_over_ = 0;    ///< blurred frames in a row that were not followed
  double step_loss_ = 0.0;  ///< share of the corners lost in the last step
  /// Of the first frame that moved far enough; nothing: none has yet.
  std::optional<std::chrono::nanoseconds> stretch_begin_;
  std::vector<Candidate> stretch_;        ///< begins `patience` before it
  std::vector<FrameDecision> decisions_;  ///< of this call
};

}  // namespace trigmesh
