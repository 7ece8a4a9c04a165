#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/features/features.hpp"
#include "tests/unit/sfm/features/synthetic_texture.hpp"

namespace trigmesh {
namespace {

using testing::random_texture;
using testing::render;
using testing::Similarity;

FeatureSet extract(const cv::Mat& grey, const FeatureOptions& options) {
  auto extractor = create_feature_extractor(FeatureKind::kSurf, options);
  EXPECT_TRUE(extractor.has_value());
  auto set = (*extractor)->extract(grey);
  EXPECT_TRUE(set.has_value());
  return set ? *set : FeatureSet{};
}

cv::Mat view(const Similarity& similarity) {
  return render(random_texture(2500, 460.0, 21), similarity, 320, 300);
}

/// Descriptor of `set` with the largest dot product to `query`.
std::size_t best_match(const FeatureSet& set, std::span<const std::uint8_t> query) {
  std::size_t best = 0;
  int best_dot = -1;
  for (std::size_t i = 0; i < set.size(); ++i) {
    const auto row = set.descriptor(i);
    const int dot = std::inner_product(row.begin(), row.end(), query.begin(), 0);
    if (dot > best_dot) {
      best_dot = dot;
      best = i;
    }
  }
  return best;
}

/// Fraction of the keypoints of the first view that lie well inside the second and whose best match
/// is the right point.
double matching_rate(const Similarity& first, const Similarity& second, bool oriented) {
  const FeatureOptions options{.max_keypoints = 400, .oriented = oriented};
  const FeatureSet a = extract(view(first), options);
  const FeatureSet b = extract(view(second), options);
  int visible = 0;
  int right = 0;
  const double turn = second.angle_rad - first.angle_rad;
  const double zoom = second.scale / first.scale;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double x = zoom * (static_cast<double>(a.keypoints[i].x_px) - first.shift_x);
    const double y = zoom * (static_cast<double>(a.keypoints[i].y_px) - first.shift_y);
    const double expected_x = std::cos(turn) * x - std::sin(turn) * y + second.shift_x;
    const double expected_y = std::sin(turn) * x + std::cos(turn) * y + second.shift_y;
    if (expected_x < 40.0 || expected_y < 40.0 || expected_x > 280.0 || expected_y > 260.0) {
      continue;
    }
    ++visible;
    const Keypoint& found = b.keypoints[best_match(b, a.descriptor(i))];
    const double error = std::hypot(static_cast<double>(found.x_px) - expected_x,
                                    static_cast<double>(found.y_px) - expected_y);
    right += error < 2.0 ? 1 : 0;
  }
  EXPECT_GT(visible, 50);
  return static_cast<double>(right) / std::max(1, visible);
}

constexpr Similarity kReference{.shift_x = 160.0, .shift_y = 150.0};

TEST(Surf, UprightPointsAreFoundAgainAfterAShiftOfFractionsOfAPixel) {
  EXPECT_GT(matching_rate(kReference, {.shift_x = 167.4, .shift_y = 146.7}, false), 0.8);
}

TEST(Surf, OrientedPointsAreFoundAgainAfterRotation) {
  for (const double degrees : {17.0, 45.0, 90.0, 161.0}) {
    const Similarity turned{
        .angle_rad = degrees * std::numbers::pi / 180.0, .shift_x = 160.0, .shift_y = 150.0};
    EXPECT_GT(matching_rate(kReference, turned, true), 0.6) << degrees;
  }
}

TEST(Surf, UprightPointsAreLostAfterALargeRotation) {
  const Similarity turned{.angle_rad = std::numbers::pi / 2.0, .shift_x = 160.0, .shift_y = 150.0};
  EXPECT_LT(matching_rate(kReference, turned, false), 0.3);
}

TEST(Surf, PointsAreFoundAgainAfterAChangeOfScale) {
  for (const double scale : {0.7, 1.5}) {
    EXPECT_GT(matching_rate(kReference, {.scale = scale, .shift_x = 160.0, .shift_y = 150.0}, true),
              0.35)
        << scale;
  }
}

TEST(Surf, KeypointsComeCoarseToFineWithinTheBudget) {
  const FeatureSet set = extract(view(kReference), {.max_keypoints = 100});
  EXPECT_EQ(set.size(), 100U);
  EXPECT_EQ(set.kind, FeatureKind::kSurf);
  EXPECT_EQ(set.descriptor_bytes, 64U);
  EXPECT_EQ(set.descriptors.size(), 6400U);
  EXPECT_TRUE(std::is_sorted(
      set.keypoints.begin(), set.keypoints.end(), [](const Keypoint& a, const Keypoint& b) {
        return a.scale_px > b.scale_px;
      }));
}

TEST(Surf, UprightKeypointsHaveNoAngle) {
  const FeatureSet set = extract(view(kReference), {.oriented = false});
  EXPECT_TRUE(std::all_of(set.keypoints.begin(), set.keypoints.end(), [](const Keypoint& k) {
    return k.angle_rad == 0.0F;
  }));
}

TEST(Surf, SameImageGivesSameBytes) {
  const cv::Mat image = view(kReference);
  const FeatureSet a = extract(image, {});
  const FeatureSet b = extract(image.clone(), {});
  EXPECT_EQ(a.descriptors, b.descriptors);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.keypoints[i].x_px, b.keypoints[i].x_px);
    EXPECT_EQ(a.keypoints[i].angle_rad, b.keypoints[i].angle_rad);
  }
}

TEST(Surf, ViewIntoALargerImageIsReadByItsRowStride) {
  const cv::Mat image = view(kReference);
  const cv::Mat part = image(cv::Rect(33, 41, 200, 180));
  EXPECT_EQ(extract(part, {}).descriptors, extract(part.clone(), {}).descriptors);
}

TEST(Surf, UpsamplingFindsMoreAndKeepsCoordinates) {
  const cv::Mat image =
      render({{.x = 60.3, .y = 50.8, .sigma = 1.4, .amplitude = 100.0}}, {}, 120, 100);
  const FeatureSet set = extract(image, {.upsample = true});
  ASSERT_GE(set.size(), 1U);
  const auto best = std::max_element(
      set.keypoints.begin(), set.keypoints.end(), [](const Keypoint& a, const Keypoint& b) {
        return a.response < b.response;
      });
  EXPECT_NEAR(best->x_px, 60.3F, 0.1F);
  EXPECT_NEAR(best->y_px, 50.8F, 0.1F);
  EXPECT_NEAR(best->scale_px, 1.4F, 0.35F);
  const cv::Mat textured = view(kReference);
  EXPECT_GT(extract(textured, {.upsample = true}).size(),
            extract(textured, {.upsample = false}).size());
}

TEST(Surf, FlatAndTinyImagesGiveEmptySets) {
  EXPECT_EQ(extract(cv::Mat(100, 140, CV_8UC1, cv::Scalar(55)), {}).size(), 0U);
  EXPECT_EQ(extract(cv::Mat(16, 16, CV_8UC1, cv::Scalar(55)), {.upsample = true}).size(), 0U);
  EXPECT_EQ(extract(view(kReference)(cv::Rect(100, 100, 16, 16)), {}).keypoints.size(), 0U);
}

TEST(Surf, WrongImagesAreRefused) {
  const auto extractor = create_feature_extractor(FeatureKind::kSurf, {});
  ASSERT_TRUE(extractor.has_value());
  for (const cv::Mat& image : {cv::Mat(), cv::Mat(15, 40, CV_8UC1), cv::Mat(40, 40, CV_8UC3)}) {
    const auto set = (*extractor)->extract(image);
    ASSERT_FALSE(set.has_value());
    EXPECT_EQ(set.error().code, ErrorCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace trigmesh
