// A match (x, x') of two views whose relative pose is known satisfies x'^T F x = 0 with F =
// K'^-T [t]x R K^-1 when its point stood still (R. Hartley, A. Zisserman, "Multiple View Geometry",
// 2nd edition, eq. 9.12). Matches far from it that follow a second epipolar geometry together are
// those of a body with a motion of its own (P. Torr, "Geometric motion segmentation and model
// selection", Phil. Trans. R. Soc. A 356, 1998).
#include "sfm/moving/contradicting_features.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "sfm/geometry/epipolar.hpp"
#include "sfm/matching/descriptor_matcher.hpp"
#include "sfm/matching/two_view_verification.hpp"

namespace trigmesh {

namespace {

constexpr int kSmallestSidePx = 16;
// Largest error of the common motion, of the distance that makes a contradiction.
constexpr double kMotionErrorRatio = 0.375;

bool is_open(const MovingView& view, const Keypoint& keypoint) {
  const int x =
      std::clamp(static_cast<int>(std::lround(keypoint.x_px)), 0, view.camera.width_px - 1);
  const int y =
      std::clamp(static_cast<int>(std::lround(keypoint.y_px)), 0, view.camera.height_px - 1);
  const bool left_out = !view.mask.empty() && view.mask.at<std::uint8_t>(y, x) == 0;
  const bool confirmed = !view.depth.empty() && view.depth.at<float>(y, x) > 0.0F;
  return !left_out && !confirmed;
}

Result<ComparableView> comparable_view(const MovingView& view, const FeatureExtractor& extractor) {
  ComparableView comparable;
  comparable.camera = view.camera;
  comparable.cam_from_world = view.cam_from_world;
  comparable.neighbors = view.neighbors;
  if (std::min(view.camera.width_px, view.camera.height_px) >= kSmallestSidePx) {
    cv::Mat grey;
    cv::cvtColor(view.rgb, grey, cv::COLOR_RGB2GRAY);
    TM_ASSIGN_OR_RETURN(comparable.features, extractor.extract(grey));
  }
  for (const Keypoint& keypoint : comparable.features.keypoints) {
    comparable.points_px.emplace_back(keypoint.x_px, keypoint.y_px);
    comparable.open.push_back(is_open(view, keypoint) ? 1 : 0);
  }
  return comparable;
}

/// Forgets all but the first (coarsest) keypoints.
void shorten(ComparableView& view, std::size_t count) {
  if (view.features.size() > count) {
    view.features.keypoints.resize(count);
    view.features.descriptors.resize(count * view.features.descriptor_bytes);
    view.points_px.resize(count);
    view.open.resize(count);
  }
}

/// Ascending pairs (first < second) in which every view meets its neighbours and others spread
/// evenly over the input.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(std::span<const ComparableView> views,
                                                          std::size_t max_partners) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  const std::size_t count = views.size();
  const auto add = [&](std::size_t a, std::size_t b) {
    if (a != b) {
      pairs.emplace_back(std::min(a, b), std::max(a, b));
    }
  };
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t near = std::min(views[i].neighbors.size(), max_partners);
    for (std::size_t n = 0; n < near; ++n) {
      add(i, views[i].neighbors[n]);
    }
    const std::size_t spread = std::min(max_partners - near, count - 1);
    for (std::size_t k = 0; k < spread; ++k) {
      add(i, (i + 1 + k * (count - 1) / spread) % count);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

Eigen::Matrix3d fundamental_of(const ComparableView& first, const ComparableView& second) {
  const Rigid3 motion = second.cam_from_world * first.cam_from_world.inverse();
  return fundamental_from_essential(essential_from_pose(motion),
                                    first.camera.calibration_matrix(),
                                    second.camera.calibration_matrix());
}

/// What one pair of views says.
struct PairOpinion {
  std::vector<FeatureMatch> agreeing;
  std::vector<FeatureMatch> contradicting;
};

VerificationImage verification_image(const ComparableView& view) {
  return {.points_px = view.points_px,
          .width_px = view.camera.width_px,
          .height_px = view.camera.height_px,
          .calibration = view.camera.calibration_matrix()};
}

PairOpinion judge_pair(const ComparableView& first,
                       const ComparableView& second,
                       std::span<const FeatureMatch> matches,
                       const ContradictionOptions& options) {
  const Eigen::Matrix3d fundamental = fundamental_of(first, second);
  PairOpinion opinion;
  std::vector<FeatureMatch> suspects;
  for (const FeatureMatch& match : matches) {
    const std::size_t i = index(match.first);
    const std::size_t j = index(match.second);
    const double error_px =
        std::sqrt(sampson_error_squared(fundamental, first.points_px[i], second.points_px[j]));
    if (error_px <= options.max_agreement_px) {
      opinion.agreeing.push_back(match);
    } else if (error_px > options.min_contradiction_px && first.open[i] != 0 &&
               second.open[j] != 0) {
      suspects.push_back(match);
    }
  }
  if (suspects.size() >= options.min_common_motion) {
    VerificationOptions verification;
    verification.max_error_px = kMotionErrorRatio * options.min_contradiction_px;
    verification.min_inliers = options.min_common_motion;
    opinion.contradicting =
        verify_pair(suspects, verification_image(first), verification_image(second), verification)
            .inliers;
  }
  return opinion;
}

/// Adds what every pair says to the evidence of its two views.
void count_opinions(std::span<const std::pair<std::size_t, std::size_t>> pairs,
                    std::span<const PairOpinion> opinions,
                    std::vector<std::vector<FeatureEvidence>>& evidence) {
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const auto [a, b] = pairs[p];
    for (const FeatureMatch& match : opinions[p].agreeing) {
      ++evidence[a][index(match.first)].agreeing;
      ++evidence[b][index(match.second)].agreeing;
    }
    for (const FeatureMatch& match : opinions[p].contradicting) {
      ++evidence[a][index(match.first)].contradicting;
      ++evidence[b][index(match.second)].contradicting;
    }
  }
}

}  // namespace

Result<> ContradictionOptions::validate() const {
  FeatureOptions features;
  features.max_keypoints = max_keypoints;
  TM_RETURN_IF_ERROR(features.validate());
  if (max_partners < 1) {
    return fail(ErrorCode::kInvalidArgument, "max_partners is 0, not >= 1");
  }
  if (!(max_agreement_px > 0.0 && max_agreement_px <= min_contradiction_px)) {
    return fail(ErrorCode::kInvalidArgument,
                "max_agreement_px is {}, not in (0, min_contradiction_px = {}]",
                max_agreement_px,
                min_contradiction_px);
  }
  if (min_common_motion < 8) {
    return fail(
        ErrorCode::kInvalidArgument, "min_common_motion is {}, not >= 8", min_common_motion);
  }
  return {};
}

bool has_moved(const FeatureEvidence& evidence) {
  return evidence.contradicting > 2 * evidence.agreeing;
}

Result<std::vector<std::vector<FeatureEvidence>>> compare_views(std::vector<ComparableView> views,
                                                                const ContradictionOptions& options,
                                                                Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  std::vector<DescriptorIndex> indexes;  // borrow from the views, which stay where they are
  std::vector<std::vector<FeatureEvidence>> evidence(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    shorten(views[i], static_cast<std::size_t>(options.max_keypoints));
    TM_ASSIGN_OR_RETURN(DescriptorIndex index_of_view, DescriptorIndex::build(views[i].features));
    indexes.push_back(std::move(index_of_view));
    for (const Keypoint& keypoint : views[i].features.keypoints) {
      evidence[i].push_back({keypoint});
    }
  }
  const auto pairs = pairs_of(views, options.max_partners);
  std::vector<PairOpinion> opinions(pairs.size());
  executor.for_each_index(pairs.size(), [&](std::size_t p) {
    const auto& [a, b] = pairs[p];
    opinions[p] = judge_pair(
        views[a], views[b], match_descriptors(indexes[a], indexes[b], MatchOptions{}), options);
  });
  count_opinions(pairs, opinions, evidence);
  return evidence;
}

Result<std::vector<std::vector<FeatureEvidence>>> find_contradicting_features(
    std::span<const MovingView> views, const ContradictionOptions& options, Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  FeatureOptions feature_options;
  feature_options.max_keypoints = options.max_keypoints;
  TM_ASSIGN_OR_RETURN(const std::unique_ptr<FeatureExtractor> extractor,
                      create_feature_extractor(FeatureKind::kSift, feature_options));
  std::vector<Result<ComparableView>> made(views.size());
  executor.for_each_index(views.size(),
                          [&](std::size_t i) { made[i] = comparable_view(views[i], *extractor); });
  std::vector<ComparableView> comparable;
  for (Result<ComparableView>& one : made) {
    TM_RETURN_IF_ERROR(one);
    comparable.push_back(std::move(*one));
  }
  return compare_views(std::move(comparable), options, executor);
}

}  // namespace trigmesh
