#include "sfm/moving/moving_regions.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "sfm/moving/region_cut.hpp"

namespace trigmesh {

namespace {

// A keypoint speaks of the disc of this many of its scales; of a large one the middle is enough.
constexpr double kDiscScales = 1.5;
constexpr double kSmallestDiscPx = 2.0;
constexpr double kLargestDiscPx = 6.0;
// Views in which a keypoint must be where the poses expect it before it counts as standing still:
// one in some twenty wrong matches is so by chance.
constexpr std::size_t kMinAgreeingViews = 2;
// Lines of hidden background are edges that a pose or map misses by a pixel: what a square of this
// side does not fit into is dropped.
constexpr int kThinPx = 3;
// Neighbouring pixels of one surface differ by less than this part of their depth.
constexpr float kLargestStep = 0.04F;
// Side of the square by which pieces are widened to see which belong together.
constexpr int kJoiningPx = 9;
// Pixels at the border of a thing show some of both.
constexpr int kMarginPx = 1;

/// All that is known of one view.
struct Evidence {
  std::vector<cv::Point> keypoints;  ///< that moved
  cv::Mat hidden;
  RegionMarks marks;
};

void draw_disc(const Keypoint& keypoint, cv::Mat& picture) {
  const cv::Point center(static_cast<int>(std::lround(keypoint.x_px)),
                         static_cast<int>(std::lround(keypoint.y_px)));
  const double radius_px = std::clamp(
      kDiscScales * static_cast<double>(keypoint.scale_px), kSmallestDiscPx, kLargestDiscPx);
  const int radius = static_cast<int>(std::lround(radius_px));
  cv::circle(picture, center, radius, cv::Scalar(255), cv::FILLED);
}

/// The pixels of the surface around `start` that were not visited yet: neighbours whose depths
/// differ by less than kLargestStep of the depth.
void trace_surface(const cv::Mat& depth,
                   cv::Point start,
                   cv::Mat& visited,
                   std::vector<cv::Point>& surface) {
  surface.assign(1, start);
  visited.at<std::uint8_t>(start) = 1;
  const cv::Rect picture(cv::Point(), depth.size());
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const cv::Point at = surface[i];
    const float here = depth.at<float>(at);
    for (const cv::Point step : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
      const cv::Point next = at + step;
      if (!picture.contains(next) || visited.at<std::uint8_t>(next) != 0) {
        continue;
      }
      const float there = depth.at<float>(next);
      if (there > 0.0F && std::abs(there - here) <= kLargestStep * here) {
        visited.at<std::uint8_t>(next) = 1;
        surface.push_back(next);
      }
    }
  }
}

/// Confirmed depth is what stood still; but a piece of surface smaller than a region may be an
/// accident, and says nothing.
cv::Mat large_surfaces(const cv::Mat& depth, const RegionOptions& options) {
  const double min_area = options.min_area_ratio * static_cast<double>(depth.total());
  cv::Mat large(depth.size(), CV_8UC1, cv::Scalar(0));
  cv::Mat visited(depth.size(), CV_8UC1, cv::Scalar(0));
  std::vector<cv::Point> surface;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (visited.at<std::uint8_t>(y, x) != 0 || !(depth.at<float>(y, x) > 0.0F)) {
        continue;
      }
      trace_surface(depth, {x, y}, visited, surface);
      if (static_cast<double>(surface.size()) >= min_area) {
        for (const cv::Point& at : surface) {
          large.at<std::uint8_t>(at) = 255;
        }
      }
    }
  }
  return large;
}

Evidence gather(const MovingView& view,
                std::span<const FeatureEvidence> features,
                cv::Mat hidden,
                const RegionOptions& options) {
  Evidence evidence;
  const cv::Size size = view.rgb.size();
  evidence.marks = {cv::Mat(size, CV_8UC1, cv::Scalar(0)),
                    cv::Mat(size, CV_8UC1, cv::Scalar(0)),
                    cv::Mat(size, CV_8UC1, cv::Scalar(0))};
  const cv::Mat square(kThinPx, kThinPx, CV_8UC1, cv::Scalar(1));
  cv::morphologyEx(hidden, evidence.hidden, cv::MORPH_OPEN, square);
  for (const FeatureEvidence& feature : features) {
    if (feature.agreeing >= kMinAgreeingViews && feature.agreeing > feature.contradicting) {
      draw_disc(feature.keypoint, evidence.marks.settled);
    } else if (feature.contradicting >= options.min_contradicting_views && has_moved(feature)) {
      draw_disc(feature.keypoint, evidence.marks.moving);
      evidence.keypoints.emplace_back(static_cast<int>(std::lround(feature.keypoint.x_px)),
                                      static_cast<int>(std::lround(feature.keypoint.y_px)));
    }
  }
  evidence.marks.moving |= evidence.hidden;
  if (!view.depth.empty()) {
    evidence.marks.moving.setTo(0, view.depth > 0.0);
    evidence.marks.fixed = large_surfaces(view.depth, options);
  }
  return evidence;
}

/// How much evidence a piece of a region has.
struct PieceTally {
  std::size_t keypoints = 0;
  double area = 0.0;
  double hidden = 0.0;
  double marked = 0.0;
};

/// Per label: what of the region and of the evidence lies in it.
std::vector<PieceTally> tally_pieces(const cv::Mat& region,
                                     const cv::Mat& labels,
                                     int count,
                                     const Evidence& evidence) {
  std::vector<PieceTally> tallies(static_cast<std::size_t>(count));
  for (int y = 0; y < region.rows; ++y) {
    for (int x = 0; x < region.cols; ++x) {
      if (region.at<std::uint8_t>(y, x) == 0) {
        continue;
      }
      PieceTally& tally = tallies[static_cast<std::size_t>(labels.at<std::int32_t>(y, x))];
      tally.area += 1.0;
      tally.hidden += evidence.hidden.at<std::uint8_t>(y, x) != 0 ? 1.0 : 0.0;
      tally.marked += evidence.marks.moving.at<std::uint8_t>(y, x) != 0 ? 1.0 : 0.0;
    }
  }
  for (const cv::Point& at : evidence.keypoints) {
    const cv::Point inside(std::clamp(at.x, 0, region.cols - 1),
                           std::clamp(at.y, 0, region.rows - 1));
    ++tallies[static_cast<std::size_t>(labels.at<std::int32_t>(inside))].keypoints;
  }
  return tallies;
}

/// The pieces of a region that have enough evidence. What stands in front (bars, twigs) cuts one
/// thing into pieces: those that lie close together are judged together.
cv::Mat accepted_pieces(const cv::Mat& region,
                        const Evidence& evidence,
                        const RegionOptions& options) {
  cv::Mat joined;
  cv::dilate(region, joined, cv::Mat(kJoiningPx, kJoiningPx, CV_8UC1, cv::Scalar(1)));
  cv::Mat labels;
  const int count = cv::connectedComponents(joined, labels, 8, CV_32S);
  const std::vector<PieceTally> tallies = tally_pieces(region, labels, count, evidence);
  cv::Mat accepted(region.size(), CV_8UC1, cv::Scalar(0));
  const auto pixels = static_cast<double>(region.total());
  for (int label = 1; label < count; ++label) {
    const PieceTally& tally = tallies[static_cast<std::size_t>(label)];
    const bool evident = tally.keypoints >= options.min_keypoints ||
                         tally.hidden >= options.min_hidden_ratio * pixels;
    if (evident && tally.area >= options.min_area_ratio * pixels &&
        tally.marked >= options.min_evidence_ratio * tally.area) {
      accepted.setTo(255, (labels == label) & region);
    }
  }
  return accepted;
}

/// Closes holes that are smaller than the smallest region.
void fill_holes(cv::Mat& mask, const RegionOptions& options) {
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centers;
  const cv::Mat outside = mask == 0;
  const int count = cv::connectedComponentsWithStats(outside, labels, stats, centers, 4, CV_32S);
  for (int label = 1; label < count; ++label) {
    const double area = stats.at<std::int32_t>(label, cv::CC_STAT_AREA);
    if (area < options.min_area_ratio * static_cast<double>(mask.total())) {
      mask.setTo(255, labels == label);
    }
  }
}

cv::Mat mask_of(const MovingView& view,
                const Evidence& evidence,
                const ColorPreference& preference,
                const RegionOptions& options) {
  if (cv::countNonZero(evidence.marks.moving) == 0) {
    return {};
  }
  cv::Mat mask = accepted_pieces(cut_region(view, evidence.marks, preference), evidence, options);
  if (cv::countNonZero(mask) == 0) {
    return {};
  }
  fill_holes(mask, options);
  constexpr int kSide = 2 * kMarginPx + 1;
  cv::dilate(mask, mask, cv::Mat(kSide, kSide, CV_8UC1, cv::Scalar(1)));
  return mask;
}

Result<> check_view(const MovingView& view, std::size_t view_count) {
  const cv::Size size(view.camera.width_px, view.camera.height_px);
  const bool fits =
      view.rgb.type() == CV_8UC3 && view.rgb.size() == size &&
      (view.mask.empty() || (view.mask.type() == CV_8UC1 && view.mask.size() == size)) &&
      (view.depth.empty() || (view.depth.type() == CV_32FC1 && view.depth.size() == size));
  const bool known = std::all_of(
      view.neighbors.begin(), view.neighbors.end(), [&](std::size_t n) { return n < view_count; });
  if (fits && known) {
    return {};
  }
  return fail(ErrorCode::kInvalidArgument,
              "picture, mask, depth and camera ({}x{}) of a view differ in size or type, or it "
              "names a neighbour that is not there",
              size.width,
              size.height);
}

}  // namespace

Result<> RegionOptions::validate() const {
  if (min_contradicting_views < 1 || min_keypoints < 1) {
    return fail(ErrorCode::kInvalidArgument,
                "min_contradicting_views is {} and min_keypoints {}, not both >= 1",
                min_contradicting_views,
                min_keypoints);
  }
  const auto is_part = [](double part) { return part > 0.0 && part < 1.0; };
  if (!is_part(min_area_ratio) || !is_part(min_hidden_ratio)) {
    return fail(ErrorCode::kInvalidArgument,
                "min_area_ratio is {} and min_hidden_ratio {}, not both in (0, 1)",
                min_area_ratio,
                min_hidden_ratio);
  }
  if (!(min_evidence_ratio >= 0.0 && min_evidence_ratio <= 1.0)) {
    return fail(
        ErrorCode::kInvalidArgument, "min_evidence_ratio is {}, not in [0, 1]", min_evidence_ratio);
  }
  return {};
}

Result<> MovingOptions::validate() const {
  TM_RETURN_IF_ERROR(features.validate());
  TM_RETURN_IF_ERROR(background.validate());
  return regions.validate();
}

Result<std::vector<cv::Mat>> find_moving_regions(std::span<const MovingView> views,
                                                 const MovingOptions& options,
                                                 Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  for (const MovingView& view : views) {
    TM_RETURN_IF_ERROR(check_view(view, views.size()));
  }
  std::vector<Evidence> evidence(views.size());
  {
    TM_ASSIGN_OR_RETURN(const auto features,
                        find_contradicting_features(views, options.features, executor));
    executor.for_each_index(views.size(), [&](std::size_t i) {
      evidence[i] = gather(views[i],
                           features[i],
                           find_hidden_background(views, i, options.background),
                           options.regions);
    });
  }
  ColorPreference preference;
  for (std::size_t i = 0; i < views.size(); ++i) {
    preference.add(views[i], evidence[i].marks.moving);
  }
  std::vector<cv::Mat> masks(views.size());
  executor.for_each_index(views.size(), [&](std::size_t i) {
    masks[i] = mask_of(views[i], evidence[i], preference, options.regions);
  });
  return masks;
}

}  // namespace trigmesh
