#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "sfm/features/features.hpp"

namespace trigmesh {
namespace {

using ::testing::Each;
using ::testing::Le;

FeatureSet extract(const cv::Mat& grey, const FeatureOptions& options = {}) {
  auto extractor = create_feature_extractor(FeatureKind::kSift, options);
  EXPECT_TRUE(extractor.has_value());
  auto features = (*extractor)->extract(grey);
  EXPECT_TRUE(features.has_value());
  return std::move(features).value();
}

struct Blob {
  double x = 0.0;
  double y = 0.0;
  double sigma = 0.0;
};

cv::Mat render(const std::vector<Blob>& blobs, int width, int height) {
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double grey = 20.0;
      for (const Blob& blob : blobs) {
        const double squared = (x - blob.x) * (x - blob.x) + (y - blob.y) * (y - blob.y);
        grey += 200.0 * std::exp(-0.5 * squared / (blob.sigma * blob.sigma));
      }
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(grey);
    }
  }
  return image;
}

/// Band-limited noise at many scales: texture that can be recognised after a warp.
cv::Mat texture(int side, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  cv::Mat sum = cv::Mat::zeros(side, side, CV_32F);
  for (const double sigma : {1.5, 3.0, 6.0, 12.0}) {
    cv::Mat layer(side, side, CV_32F);
    std::generate(layer.begin<float>(), layer.end<float>(), [&] { return normal(random); });
    cv::GaussianBlur(layer, layer, {}, sigma);
    sum += 60.0 * sigma * layer;
  }
  cv::Mat image;
  sum.convertTo(image, CV_8U, 1.0, 128.0);
  return image;
}

const Keypoint* nearest(const FeatureSet& features, const Blob& blob, double expected_scale) {
  const Keypoint* best = nullptr;
  double best_distance = 1.0;
  for (const Keypoint& keypoint : features.keypoints) {
    const double distance = std::hypot(static_cast<double>(keypoint.x_px) - blob.x,
                                       static_cast<double>(keypoint.y_px) - blob.y);
    const double ratio = static_cast<double>(keypoint.scale_px) / expected_scale;
    if (distance < best_distance && ratio > 0.7 && ratio < 1.4) {
      best = &keypoint;
      best_distance = distance;
    }
  }
  return best;
}

class SiftBlobs : public ::testing::TestWithParam<bool> {};

// The extremum of G(k s) - G(s) at the centre of a Gaussian blob of deviation t lies at s = t /
// sqrt(k), all without the blur of 0.5 px that the input is taken to have; k = 2^(1/3).
TEST_P(SiftBlobs, AreFoundAtTheirSubpixelPlaceAndScaleInEveryOctave) {
  const double k = std::cbrt(2.0);
  const double smallest = GetParam() ? 1.3 : 2.6;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> offset(-0.5, 0.5);
  double worst = 0.0;
  int octaves = 0;
  for (double sigma = smallest; sigma < 24.0; sigma *= 1.37, ++octaves) {
    const int side = static_cast<int>(16.0 * sigma) + 80;
    for (int i = 0; i < 8; ++i) {
      const Blob blob{0.5 * side + offset(random), 0.5 * side + offset(random), sigma};
      const double expected = std::sqrt((sigma * sigma - 0.25) / k);
      const FeatureSet features = extract(render({blob}, side, side), {.upsample = GetParam()});
      const Keypoint* found = nearest(features, blob, expected);
      ASSERT_NE(found, nullptr) << "sigma " << sigma;
      const double error = std::hypot(static_cast<double>(found->x_px) - blob.x,
                                      static_cast<double>(found->y_px) - blob.y);
      worst = std::max(worst, error);
      // The sampling of the coarse octaves is that much coarser.
      EXPECT_LT(error, std::max(0.05, 0.015 * expected)) << "sigma " << sigma;
      EXPECT_NEAR(static_cast<double>(found->scale_px) / expected, 1.0, 0.05) << "sigma " << sigma;
    }
  }
  RecordProperty("worst_px", std::to_string(worst));
}

TEST_P(SiftBlobs, HaveNoCommonShift) {
  double sum_x = 0.0;
  double sum_y = 0.0;
  int count = 0;
  for (const double sigma : {3.0, 5.3, 11.0}) {
    for (int i = 0; i < 16; ++i) {
      const Blob blob{100.0 + 0.25 * (i % 4), 100.0 + 0.25 * (i / 4), sigma};
      const FeatureSet features = extract(render({blob}, 200, 200), {.upsample = GetParam()});
      const Keypoint* found = nearest(features, blob, sigma * 0.89);
      ASSERT_NE(found, nullptr);
      sum_x += static_cast<double>(found->x_px) - blob.x;
      sum_y += static_cast<double>(found->y_px) - blob.y;
      ++count;
    }
  }
  EXPECT_NEAR(sum_x / count, 0.0, 0.01);
  EXPECT_NEAR(sum_y / count, 0.0, 0.01);
}

INSTANTIATE_TEST_SUITE_P(InputAndDoubleSize, SiftBlobs, ::testing::Bool());

struct Repeat {
  double repeated_ratio = 0.0;  ///< of the keypoints of the first image that are inside the second
  double matched_ratio = 0.0;   ///< of those: the nearest descriptor is the right one
  double median_angle_error_deg = 0.0;
};

cv::Point2d place(const Keypoint& keypoint) {
  return {static_cast<double>(keypoint.x_px), static_cast<double>(keypoint.y_px)};
}

/// A column for each feature.
Eigen::MatrixXf descriptor_columns(const FeatureSet& features) {
  using Bytes = Eigen::Matrix<std::uint8_t, 128, Eigen::Dynamic>;
  const auto count = static_cast<Eigen::Index>(features.size());
  return Eigen::Map<const Bytes>(features.descriptors.data(), 128, count).cast<float>();
}

/// Compares the keypoints of a 400x400 image and of its warp by the similarity `warp`. Left out are
/// points that come to lie within `border` of the border and those that become finer than what is
/// searched.
Repeat compare(const FeatureSet& from,
               const FeatureSet& to,
               const cv::Matx23d& warp,
               double border) {
  const double scale = std::hypot(warp(0, 0), warp(1, 0));
  const double turn = std::atan2(warp(1, 0), warp(0, 0));
  const cv::Rect2d inside(border, border, 400 - 2 * border, 400 - 2 * border);
  const Eigen::MatrixXf from_columns = descriptor_columns(from);
  const Eigen::MatrixXf to_rows = descriptor_columns(to).transpose();
  int visible = 0;
  int repeated = 0;
  std::vector<double> angle_errors;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Keypoint& a = from.keypoints[i];
    const cv::Vec2d p = warp * cv::Vec3d(place(a).x, place(a).y, 1.0);
    const double expected_scale = scale * static_cast<double>(a.scale_px);
    const auto is_repeat = [&](const Keypoint& b) {
      const double other_scale = static_cast<double>(b.scale_px);
      return std::hypot(p[0] - place(b).x, p[1] - place(b).y) < 1.0 + 0.15 * other_scale &&
             std::abs(std::log(other_scale / expected_scale)) < 0.3;
    };
    if (!inside.contains(cv::Point2d(p)) || expected_scale < 2.2) {
      continue;
    }
    ++visible;
    if (std::none_of(to.keypoints.begin(), to.keypoints.end(), is_repeat)) {
      continue;
    }
    ++repeated;
    std::size_t nearest = 0;
    (to_rows * from_columns.col(static_cast<Eigen::Index>(i))).maxCoeff(&nearest);
    const Keypoint& match = to.keypoints[nearest];
    if (is_repeat(match)) {
      const double error = static_cast<double>(match.angle_rad - a.angle_rad) - turn;
      angle_errors.push_back(std::abs(std::remainder(error, 2.0 * std::numbers::pi)));
    }
  }
  std::sort(angle_errors.begin(), angle_errors.end());
  const double median = angle_errors.empty() ? 3.0 : angle_errors[angle_errors.size() / 2];
  return {static_cast<double>(repeated) / visible,
          static_cast<double>(angle_errors.size()) / repeated,
          median * 180.0 / std::numbers::pi};
}

TEST(SiftSlow, FindsAndRecognisesTextureAfterTurningAndZooming) {
  const cv::Mat image = texture(400, 11);
  const FeatureSet from = extract(image);
  ASSERT_GT(from.size(), 300U);
  for (const double angle_deg : {0.0, 37.0, 90.0, 161.0}) {
    for (const double scale : {1.0, 1.3, 0.75}) {
      const cv::Matx23d warp = cv::getRotationMatrix2D({199.5F, 199.5F}, -angle_deg, scale);
      cv::Mat warped;
      cv::warpAffine(image, warped, warp, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
      const Repeat repeat = compare(from, extract(warped), warp, 60.0);
      EXPECT_GT(repeat.repeated_ratio, 0.80) << angle_deg << " deg, scale " << scale;
      EXPECT_GT(repeat.matched_ratio, 0.90) << angle_deg << " deg, scale " << scale;
      EXPECT_LT(repeat.median_angle_error_deg, 2.0) << angle_deg << " deg, scale " << scale;
    }
  }
}

TEST(Sift, UprightKeypointsHaveNoAngleAndRecogniseAShiftedImage) {
  const cv::Mat image = texture(400, 12);
  const cv::Matx23d warp(1.05, 0.0, 7.3, 0.0, 1.05, -4.6);
  cv::Mat warped;
  cv::warpAffine(image, warped, warp, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  const FeatureSet from = extract(image, {.oriented = false});
  for (const Keypoint& keypoint : from.keypoints) {
    ASSERT_EQ(keypoint.angle_rad, 0.0F);
  }
  const Repeat repeat = compare(from, extract(warped, {.oriented = false}), warp, 50.0);
  EXPECT_GT(repeat.repeated_ratio, 0.80);
  EXPECT_GT(repeat.matched_ratio, 0.95);
}

TEST(Sift, DescriptorsDoNotDependOnBrightnessAndContrast) {
  const cv::Mat image = texture(400, 13);
  cv::Mat darker;
  image.convertTo(darker, CV_8U, 0.6, 10.0);
  const Repeat repeat = compare(extract(image), extract(darker), cv::Matx23d::eye(), 30.0);
  EXPECT_GT(repeat.repeated_ratio, 0.85);
  EXPECT_GT(repeat.matched_ratio, 0.98);
}

TEST(Sift, DescriptorsAreSevenBitVectorsOfNearlyEqualLength) {
  const FeatureSet features = extract(texture(300, 14));
  ASSERT_EQ(features.descriptor_bytes, 128U);
  ASSERT_EQ(features.descriptors.size(), 128 * features.size());
  EXPECT_THAT(features.descriptors, Each(Le(127)));
  for (std::size_t i = 0; i < features.size(); ++i) {
    double squares = 0.0;
    for (const std::uint8_t entry : features.descriptor(i)) {
      squares += static_cast<double>(entry) * entry;
    }
    ASSERT_NEAR(std::sqrt(squares), 256.0, 5.0);
  }
}

TEST(Sift, KeypointsComeCoarsestFirst) {
  for (const bool upsample : {false, true}) {
    const FeatureSet features = extract(texture(300, 15), {.upsample = upsample});
    ASSERT_GT(features.size(), 100U);
    EXPECT_TRUE(std::is_sorted(
        features.keypoints.begin(),
        features.keypoints.end(),
        [](const Keypoint& a, const Keypoint& b) { return a.scale_px > b.scale_px; }));
  }
}

TEST(Sift, BudgetIsKeptAndSpentAllOverTheImage) {
  const FeatureSet features = extract(texture(600, 16), {.max_keypoints = 300});
  EXPECT_LE(features.size(), 300U);
  EXPECT_GE(features.size(), 295U);
  int cells[3][3] = {};
  for (const Keypoint& keypoint : features.keypoints) {
    ++cells[static_cast<int>(keypoint.y_px / 200.1F)][static_cast<int>(keypoint.x_px / 200.1F)];
  }
  for (const auto& row : cells) {
    for (const int count : row) {
      EXPECT_GT(count, 20);
    }
  }
}

TEST(Sift, FlatImageIsEmptyAndNotAnError) {
  EXPECT_EQ(extract(cv::Mat(200, 300, CV_8UC1, cv::Scalar(128))).size(), 0U);
  EXPECT_EQ(extract(cv::Mat(200, 300, CV_8UC1, cv::Scalar(255)), {.upsample = true}).size(), 0U);
}

TEST(Sift, ImagesThatAreNotGreyOrTooSmallAreRefused) {
  const auto extractor = create_feature_extractor(FeatureKind::kSift, {}).value();
  for (const cv::Mat& image : {cv::Mat(),
                               cv::Mat(100, 100, CV_8UC3, cv::Scalar::all(1)),
                               cv::Mat(100, 100, CV_16UC1, cv::Scalar(1)),
                               cv::Mat(15, 100, CV_8UC1, cv::Scalar(1)),
                               cv::Mat(5000, 1, CV_8UC1, cv::Scalar(1))}) {
    const auto features = extractor->extract(image);
    ASSERT_FALSE(features.has_value());
    EXPECT_EQ(features.error().code, ErrorCode::kInvalidArgument);
  }
}

TEST(Sift, SmallNarrowAndOddSizesAreServed) {
  std::mt19937 random(17);
  for (const auto& [width, height] :
       {std::pair(16, 16), {17, 16}, {16, 6000}, {5003, 17}, {801, 31}}) {
    cv::Mat noise(height, width, CV_8UC1);
    std::generate(noise.begin<std::uint8_t>(), noise.end<std::uint8_t>(), [&] {
      return static_cast<std::uint8_t>(random() & 255U);
    });
    for (const bool upsample : {false, true}) {
      const FeatureSet features = extract(noise, {.upsample = upsample});
      for (const Keypoint& keypoint : features.keypoints) {
        ASSERT_GE(keypoint.x_px, 0.0F);
        ASSERT_LE(keypoint.x_px, static_cast<float>(width - 1));
        ASSERT_GE(keypoint.y_px, 0.0F);
        ASSERT_LE(keypoint.y_px, static_cast<float>(height - 1));
      }
    }
  }
}

TEST(Sift, PartOfALargerImageGivesTheSameAsItsCopy) {
  const cv::Mat image = texture(300, 18);
  const cv::Mat part = image(cv::Rect(31, 17, 201, 155));
  const FeatureSet a = extract(part);
  const FeatureSet b = extract(part.clone());
  EXPECT_EQ(a.descriptors, b.descriptors);
}

bool are_identical(const FeatureSet& a, const FeatureSet& b) {
  return a.descriptors == b.descriptors &&
         std::equal(a.keypoints.begin(),
                    a.keypoints.end(),
                    b.keypoints.begin(),
                    b.keypoints.end(),
                    [](const Keypoint& p, const Keypoint& q) {
                      return p.x_px == q.x_px && p.y_px == q.y_px && p.scale_px == q.scale_px &&
                             p.angle_rad == q.angle_rad && p.response == q.response;
                    });
}

TEST(Sift, IsDeterministicOverCallsSizesAndThreads) {
  const auto extractor =
      create_feature_extractor(FeatureKind::kSift, {.max_keypoints = 500}).value();
  const cv::Mat image = texture(400, 19);
  const FeatureSet first = extractor->extract(image).value();
  ASSERT_TRUE(
      extractor->extract(texture(123, 20)).has_value());  // leaves its traces in the work space
  EXPECT_TRUE(are_identical(extractor->extract(image).value(), first));
  std::array<FeatureSet, 2> results;
  {
    std::jthread one([&] { results[0] = extractor->extract(image).value(); });
    std::jthread two([&] { results[1] = extractor->extract(image).value(); });
  }
  EXPECT_TRUE(are_identical(results[0], first));
  EXPECT_TRUE(are_identical(results[1], first));
}

}  // namespace
}  // namespace trigmesh
