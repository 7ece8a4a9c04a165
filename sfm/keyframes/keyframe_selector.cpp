#include "sfm/keyframes/keyframe_selector.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "firmware/base/check.hpp"
#include "sfm/keyframes/sharpness.hpp"

namespace trigmesh {
namespace {

/// Frames whose median says how sharp and how bright the scene is.
constexpr std::size_t kSharpnessWindow = 31;
constexpr std::size_t kBrightnessWindow = 5;
/// Also where most frames are blurred, the sharp ones say what is usual.
constexpr double kUsualShare = 0.75;
/// Blurred frames in a row that are stepped over: corners are lost in them. Later ones are
/// followed, for nothing better comes.
constexpr int kMostSteppedOver = 5;
/// Frames among which the blurriest tenth is to be avoided.
constexpr std::size_t kSharpnessHistory = 300;
constexpr double kBlurriestShare = 0.1;
/// Mean difference of grey values below which two frames are the same picture: sensor noise alone
/// is above.
constexpr double kDuplicateDifference = 0.05;
constexpr double kLeastFocalRatio = 0.2;
constexpr double kMostFocalRatio = 10.0;
/// A picture with fewer corners is too dark or too blurred to go on from.
constexpr std::size_t kFewestCorners = 16;

/// The value below which `share` of the last `count` values lie. Precondition: there is a value.
double quantile(std::span<const double> values, std::size_t count, double share) {
  const auto last = values.last(std::min(values.size(), count));
  std::array<double, kSharpnessHistory> sorted{};
  const auto end = std::copy(last.begin(), last.end(), sorted.begin());
  const auto place =
      sorted.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(last.size()));
  std::nth_element(sorted.begin(), place, end);
  return *place;
}

void remember(std::vector<double>& values, double value, std::size_t count) {
  if (values.size() == count) {
    values.erase(values.begin());
  }
  values.push_back(value);
}

bool is_same_picture(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() &&
         cv::norm(a, b, cv::NORM_L1) < kDuplicateDifference * static_cast<double>(a.total());
}

Result<> check_range(const char* name, double value, double min, double max) {
  if (value >= min && value <= max) {
    return {};
  }
  return fail(ErrorCode::kInvalidArgument, "{} is {}, must be {} to {}", name, value, min, max);
}

}  // namespace

double focal_ratio_of(double focal_px, int longer_side_px) {
  return std::clamp(focal_px / std::max(longer_side_px, 1), kLeastFocalRatio, kMostFocalRatio);
}

Result<> KeyframeOptions::validate() const {
  TM_RETURN_IF_ERROR(check_range("image_side_px", image_side_px, 64, 2000));
  TM_RETURN_IF_ERROR(check_range("focal_ratio", focal_ratio, kLeastFocalRatio, kMostFocalRatio));
  TM_RETURN_IF_ERROR(check_range("min_motion_deg", min_motion_deg, 1e-3, 30.0));
  TM_RETURN_IF_ERROR(check_range("max_motion_deg", max_motion_deg, min_motion_deg, 90.0));
  TM_RETURN_IF_ERROR(check_range("slow_motion_deg", slow_motion_deg, 1e-4, min_motion_deg));
  TM_RETURN_IF_ERROR(check_range("max_overlap", max_overlap, min_overlap, 1.0));
  TM_RETURN_IF_ERROR(check_range("min_overlap", min_overlap, lost_overlap, 1.0));
  TM_RETURN_IF_ERROR(check_range("lost_overlap", lost_overlap, 1e-3, 1.0));
  TM_RETURN_IF_ERROR(check_range("min_relative_sharpness", min_relative_sharpness, 0.0, 0.99));
  TM_RETURN_IF_ERROR(check_range("max_step_loss", max_step_loss, 0.01, 0.99));
  TM_RETURN_IF_ERROR(check_range("max_brightness_ratio", max_brightness_ratio, 1.001, 100.0));
  TM_RETURN_IF_ERROR(check_range("max_waiting", static_cast<double>(max_waiting), 2, 10000));
  if (slow_interval.count() <= 0 || stretch.count() <= 0 || min_interval.count() < 0) {
    return fail(ErrorCode::kInvalidArgument,
                "slow_interval and stretch must be more than 0 and min_interval not negative");
  }
  return tracker.validate();
}

Result<KeyframeSelector> KeyframeSelector::create(const KeyframeOptions& options) {
  TM_RETURN_IF_ERROR(options.validate());
  return KeyframeSelector(options);
}

std::span<const FrameDecision> KeyframeSelector::offer(const VideoFrame& frame) {
  decisions_.clear();
  Candidate candidate = look_at(frame);
  const bool is_duplicate = last_pyramid_ != nullptr &&
                            is_same_picture(last_pyramid_->front(), candidate.pyramid->front());
  if (is_duplicate) {
    decide(candidate, FrameVerdict::kDuplicate);
  } else {
    judge(std::move(candidate));
  }
  return decisions_;
}

std::span<const FrameDecision> KeyframeSelector::finish() {
  decisions_.clear();
  // A stretch that has not come to its end is worth a sharp frame only.
  while (!stretch_.empty()) {
    const std::size_t best = choose_keyframe();
    if (best < stretch_.size() &&
        (reference_.empty() || !is_blurry(stretch_[best].measures.sharpness))) {
      close_stretch();
      continue;
    }
    for (const Candidate& candidate : std::exchange(stretch_, {})) {
      decide(candidate, candidate.refusal);
    }
  }
  KeyframeSelector anew(options_);
  anew.decisions_ = std::move(decisions_);
  anew.pyramids_ = std::move(pyramids_);
  *this = std::move(anew);
  return decisions_;
}

KeyframeSelector::Candidate KeyframeSelector::look_at(const VideoFrame& frame) {
  TM_CHECK(frame.grey.type() == CV_8UC1);
  Candidate candidate;
  candidate.id = frame.id;
  candidate.timestamp = frame.timestamp;
  candidate.pyramid = pyramids_.make(frame.grey, options_.image_side_px, options_.tracker.levels);
  const cv::Mat& grey = candidate.pyramid->front();
  image_size_ = grey.size();
  candidate.measures.sharpness = variance_of_laplacian(grey);
  candidate.measures.brightness = cv::mean(grey)[0];
  remember(last_sharpness_, candidate.measures.sharpness, kSharpnessHistory);
  candidate.measures.relative_sharpness =
      candidate.measures.sharpness /
      std::max(quantile(last_sharpness_, kSharpnessWindow, kUsualShare), 1e-9);
  return candidate;
}

void KeyframeSelector::judge(Candidate candidate) {
  const double brightness = std::max(candidate.measures.brightness, 1.0);
  const double usual = last_brightness_.empty()
                           ? brightness
                           : std::max(quantile(last_brightness_, kBrightnessWindow, 0.5), 1.0);
  // A jump that stays becomes the usual brightness after a few frames.
  remember(last_brightness_, brightness, kBrightnessWindow);
  if (std::max(brightness / usual, usual / brightness) > options_.max_brightness_ratio) {
    decide(candidate, FrameVerdict::kExposureJump);
    return;
  }
  place(std::move(candidate));
}

void KeyframeSelector::place(Candidate candidate) {
  if (reference_.empty()) {
    place_without_reference(std::move(candidate));
    return;
  }
  const bool is_blurred = candidate.measures.relative_sharpness < options_.min_relative_sharpness;
  if (is_blurred && stepped_over_ < kMostSteppedOver) {
    ++stepped_over_;
    decide(candidate, FrameVerdict::kBlurred);
    return;
  }
  stepped_over_ = is_blurred ? stepped_over_ : 0;
  follow_corners(candidate.pyramid);
  measure_motion(candidate.measures);
  if (candidate.measures.overlap < options_.lost_overlap) {
    lose_track(std::move(candidate));
  } else if (is_blurred) {
    decide(candidate, FrameVerdict::kBlurred);
  } else if (step_loss_ > options_.max_step_loss) {
    decide(candidate, FrameVerdict::kTooFast);
  } else {
    extend_stretch(std::move(candidate));
  }
}

void KeyframeSelector::place_without_reference(Candidate candidate) {
  last_pyramid_ = candidate.pyramid;
  candidate.is_wanted = true;
  candidate.refusal = FrameVerdict::kBlurred;
  if (stretch_.empty()) {
    stretch_begin_ = candidate.timestamp;
  }
  stretch_.push_back(std::move(candidate));
  if (stretch_.back().timestamp - *stretch_begin_ >= options_.stretch || is_full()) {
    close_stretch();
  }
}

bool KeyframeSelector::is_full() const {
  return stretch_.size() >= options_.max_waiting;
}

void KeyframeSelector::extend_stretch(Candidate candidate) {
  candidate.is_wanted = has_moved(candidate);
  candidate.refusal = candidate.is_wanted ? FrameVerdict::kBlurred : FrameVerdict::kTooLittleMotion;
  const bool is_last = ends_stretch(candidate.measures);
  const bool is_early = candidate.timestamp - *keyframe_time_ < options_.min_interval;
  if (candidate.is_wanted && is_early && !is_last) {
    decide(candidate, FrameVerdict::kOverBudget);
    return;
  }
  if (candidate.is_wanted && !stretch_begin_.has_value()) {
    stretch_begin_ = candidate.timestamp;
  }
  stretch_.push_back(std::move(candidate));
  forget_early_frames();
  if (!stretch_begin_.has_value()) {
    return;
  }
  const bool is_over = stretch_.back().timestamp - *stretch_begin_ >= options_.stretch;
  if (is_full() || ((is_last || is_over) && !may_wait(stretch_.back().measures))) {
    close_stretch();
  }
}

/// Those from before the stretch: when none has begun for long, or for want of room.
void KeyframeSelector::forget_early_frames() {
  std::size_t early = 0;
  const auto may_go = [&](const Candidate& candidate) {
    const std::chrono::nanoseconds age = stretch_.back().timestamp - candidate.timestamp;
    const bool is_old = !stretch_begin_.has_value() && age > options_.patience;
    return !candidate.is_wanted && (is_old || stretch_.size() - early >= options_.max_waiting);
  };
  for (; early < stretch_.size() && may_go(stretch_[early]); ++early) {
    decide(stretch_[early], stretch_[early].refusal);
  }
  stretch_.erase(stretch_.begin(), stretch_.begin() + static_cast<std::ptrdiff_t>(early));
}

/// Whether it is worth and safe to wait for a sharper frame.
bool KeyframeSelector::may_wait(const FrameMeasures& measures) const {
  const std::chrono::nanoseconds waited = stretch_.back().timestamp - *stretch_begin_;
  const double safe_overlap = 0.5 * (options_.min_overlap + options_.lost_overlap);
  return is_blurry(stretch_[choose_keyframe()].measures.sharpness) &&
         waited < options_.stretch + options_.patience && measures.overlap > safe_overlap;
}

bool KeyframeSelector::is_blurry(double sharpness) const {
  return sharpness < quantile(last_sharpness_, kSharpnessHistory, kBlurriestShare);
}

void KeyframeSelector::lose_track(Candidate candidate) {
  candidate.refusal =
      step_loss_ > options_.max_step_loss ? FrameVerdict::kTooFast : FrameVerdict::kTrackLost;
  stretch_.push_back(std::move(candidate));
  // What was seen on the way connects: the frame is looked at again from there.
  close_stretch();
}

/// Place of the sharpest wanted frame; the end if there is none.
std::size_t KeyframeSelector::sharpest_wanted() const {
  std::size_t best = stretch_.size();
  for (std::size_t i = 0; i < stretch_.size(); ++i) {
    const bool is_sharper = best == stretch_.size() ||
                            stretch_[i].measures.sharpness > stretch_[best].measures.sharpness;
    best = stretch_[i].is_wanted && is_sharper ? i : best;
  }
  return best;
}

/// Place of the frame to keep; the end if there is none.
std::size_t KeyframeSelector::choose_keyframe() const {
  std::size_t best = sharpest_wanted();
  if (best == stretch_.size() || !is_blurry(stretch_[best].measures.sharpness)) {
    return best;
  }
  for (std::size_t i = 0; i < stretch_.size(); ++i) {
    const FrameMeasures& measures = stretch_[i].measures;
    if (measures.motion_deg >= options_.slow_motion_deg &&
        measures.sharpness > stretch_[best].measures.sharpness) {
      best = i;
    }
  }
  return best;
}

void KeyframeSelector::close_stretch() {
  const std::size_t best = choose_keyframe();
  const std::vector<Candidate> stretch = std::exchange(stretch_, {});
  stretch_.reserve(stretch.capacity());
  stretch_begin_.reset();
  const bool has_keyframe = best < stretch.size() && start_from(stretch[best]);
  if (!has_keyframe) {
    reference_.clear();
  }
  for (std::size_t i = 0; i < stretch.size(); ++i) {
    if (has_keyframe && i > best) {
      place(stretch[i]);
    } else {
      decide(stretch[i], has_keyframe && i == best ? FrameVerdict::kKept : stretch[i].refusal);
    }
  }
}

bool KeyframeSelector::start_from(const Candidate& keyframe) {
  reference_ = find_corners(keyframe.pyramid->front(), options_.tracker);
  if (reference_.size() < kFewestCorners) {
    return false;
  }
  corners_.assign(reference_.begin(), reference_.end());
  last_pyramid_ = keyframe.pyramid;
  keyframe_time_ = keyframe.timestamp;
  return true;
}

void KeyframeSelector::follow_corners(const std::shared_ptr<const ImagePyramid>& pyramid) {
  std::size_t followed = 0;
  std::size_t lost = 0;
  for (std::optional<Eigen::Vector2f>& corner : corners_) {
    if (corner.has_value()) {
      ++followed;
      corner = track_corner(*last_pyramid_, *pyramid, *corner, options_.tracker);
      lost += corner.has_value() ? 0U : 1U;
    }
  }
  step_loss_ = followed == 0 ? 1.0 : static_cast<double>(lost) / static_cast<double>(followed);
  last_pyramid_ = pyramid;
}

void KeyframeSelector::measure_motion(FrameMeasures& measures) {
  view_change_.begin();
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (corners_[i].has_value()) {
      view_change_.add(ray_of(reference_[i]), ray_of(*corners_[i]));
    }
  }
  const ViewChange change = view_change_.measure();
  measures.motion_deg = change.motion_deg;
  measures.parallax_deg = change.parallax_deg;
  measures.overlap =
      static_cast<double>(view_change_.ray_count()) / static_cast<double>(reference_.size());
}

bool KeyframeSelector::has_moved(const Candidate& candidate) const {
  const FrameMeasures& measures = candidate.measures;
  const bool is_slow = candidate.timestamp - *keyframe_time_ >= options_.slow_interval;
  return measures.motion_deg >= (is_slow ? options_.slow_motion_deg : options_.min_motion_deg) ||
         measures.overlap <= options_.max_overlap;
}

bool KeyframeSelector::ends_stretch(const FrameMeasures& measures) const {
  return measures.motion_deg >= options_.max_motion_deg || measures.overlap <= options_.min_overlap;
}

void KeyframeSelector::decide(const Candidate& candidate, FrameVerdict verdict) {
  decisions_.push_back({candidate.id, verdict, candidate.measures});
}

Eigen::Vector3d KeyframeSelector::ray_of(const Eigen::Vector2f& pixel) const {
  const double focal_px = options_.focal_ratio * std::max(image_size_.width, image_size_.height);
  const Eigen::Vector2d centre(0.5 * (image_size_.width - 1), 0.5 * (image_size_.height - 1));
  return ((pixel.cast<double>() - centre) / focal_px).homogeneous().normalized();
}

}  // namespace trigmesh
