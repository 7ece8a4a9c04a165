#include "sfm/features/surf_descriptor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/sfm/features/synthetic_texture.hpp"

namespace trigmesh {
namespace {

using testing::random_texture;
using testing::render;

constexpr double kPi = std::numbers::pi;

/// Sum of the image (pixels as little squares, border replicated) over a real rectangle.
double loop_sum(const cv::Mat& image, double x0, double y0, double x1, double y1) {
  double sum = 0.0;
  for (int y = static_cast<int>(std::floor(y0 + 0.5)); y <= static_cast<int>(std::floor(y1 + 0.5));
       ++y) {
    for (int x = static_cast<int>(std::floor(x0 + 0.5));
         x <= static_cast<int>(std::floor(x1 + 0.5));
         ++x) {
      const double width = std::min(x1, x + 0.5) - std::max(x0, x - 0.5);
      const double height = std::min(y1, y + 0.5) - std::max(y0, y - 0.5);
      sum += std::max(0.0, width) * std::max(0.0, height) *
             image.at<std::uint8_t>(std::clamp(y, 0, image.rows - 1),
                                    std::clamp(x, 0, image.cols - 1));
    }
  }
  return sum;
}

/// The upright descriptor of the paper by plain loops, in the paper's basis (sum dx, sum |dx|, sum
/// dy, sum |dy|), unit length.
std::vector<double> paper_descriptor(const cv::Mat& image, const Keypoint& keypoint) {
  const double s = static_cast<double>(keypoint.scale_px);
  std::vector<double> result(64, 0.0);
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 20; ++j) {
      const double u = j - 9.5;
      const double v = i - 9.5;
      const double x = static_cast<double>(keypoint.x_px) + u * s;
      const double y = static_cast<double>(keypoint.y_px) + v * s;
      const double weight = std::exp(-(u * u + v * v) / (2.0 * 3.3 * 3.3));
      const double dx =
          weight *
          (loop_sum(image, x, y - s, x + s, y + s) - loop_sum(image, x - s, y - s, x, y + s)) /
          (s * s);
      const double dy =
          weight *
          (loop_sum(image, x - s, y, x + s, y + s) - loop_sum(image, x - s, y - s, x + s, y)) /
          (s * s);
      double* out = result.data() + 4 * (4 * (i / 5) + j / 5);
      out[0] += dx;
      out[1] += std::abs(dx);
      out[2] += dy;
      out[3] += std::abs(dy);
    }
  }
  const double norm =
      std::sqrt(std::inner_product(result.begin(), result.end(), result.begin(), 0.0));
  std::transform(result.begin(), result.end(), result.begin(), [&](double v) { return v / norm; });
  return result;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  return std::sqrt(
      std::inner_product(a.begin(), a.end(), b.begin(), 0.0, std::plus<>(), [](double p, double q) {
        return (p - q) * (p - q);
      }));
}

std::vector<double> widened(const SurfVector& v) {
  return {v.begin(), v.end()};
}

std::array<std::uint8_t, 64> bytes_of(const SurfVector& v) {
  std::array<std::uint8_t, 64> bytes{};
  quantize_surf(v, bytes);
  return bytes;
}

cv::Mat textured(double angle_rad = 0.0, double scale = 1.0) {
  return render(random_texture(1200, 260.0, 11),
                {.scale = scale, .angle_rad = angle_rad, .shift_x = 128.0, .shift_y = 128.0},
                257,
                257);
}

std::vector<Keypoint> sample_keypoints() {
  std::vector<Keypoint> keypoints;
  for (int i = 0; i < 40; ++i) {
    keypoints.push_back({.x_px = 60.0F + 3.37F * static_cast<float>(i),
                         .y_px = 190.0F - 3.11F * static_cast<float>(i),
                         .scale_px = 1.7F + 0.06F * static_cast<float>(i),
                         .angle_rad = 0.0F,
                         .response = 1.0F});
  }
  return keypoints;
}

TEST(SurfDescriptor, IsThePapersDescriptorInATurnedBasis) {
  const cv::Mat image = textured();
  const IntegralImage integral(image);
  for (const Keypoint& keypoint : sample_keypoints()) {
    const auto paper = paper_descriptor(image, keypoint);
    const SurfVector ours = surf_descriptor(integral, keypoint);
    for (std::size_t k = 0; k < 64; k += 2) {
      // sum = positive - negative, absolute sum = positive + negative; sqrt(2) because both vectors
      // have unit length.
      const double positive = static_cast<double>(ours[k]);
      const double negative = static_cast<double>(ours[k + 1]);
      EXPECT_NEAR((positive - negative) / std::numbers::sqrt2, paper[k], 2e-4);
      EXPECT_NEAR((positive + negative) / std::numbers::sqrt2, paper[k + 1], 2e-4);
    }
  }
}

TEST(SurfDescriptor, KeepsTheDistancesOfThePaper) {
  const cv::Mat image = textured();
  const IntegralImage integral(image);
  const auto keypoints = sample_keypoints();
  for (std::size_t i = 1; i < keypoints.size(); ++i) {
    const double ours = distance(widened(surf_descriptor(integral, keypoints[0])),
                                 widened(surf_descriptor(integral, keypoints[i])));
    const double paper =
        distance(paper_descriptor(image, keypoints[0]), paper_descriptor(image, keypoints[i]));
    EXPECT_NEAR(ours, paper, 1e-3);
  }
}

TEST(SurfDescriptor, LargerDotProductOfBytesMeansSmallerDistance) {
  const cv::Mat image = textured();
  const IntegralImage integral(image);
  std::vector<std::vector<double>> paper;
  std::vector<std::array<std::uint8_t, 64>> bytes;
  for (const Keypoint& keypoint : sample_keypoints()) {
    const auto row = bytes_of(surf_descriptor(integral, keypoint));
    // A component cut at 127 bends the metric; that is the price of a byte.
    if (*std::max_element(row.begin(), row.end()) < 127) {
      paper.push_back(paper_descriptor(image, keypoint));
      bytes.push_back(row);
    }
  }
  int compared = 0;
  for (std::size_t q = 0; q < bytes.size(); ++q) {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      for (std::size_t j = 0; j < bytes.size(); ++j) {
        // Differences in distance below the rounding to bytes may come out either way.
        if (distance(paper[q], paper[i]) + 0.03 < distance(paper[q], paper[j])) {
          const auto dot = [&](std::size_t k) {
            return std::inner_product(bytes[q].begin(), bytes[q].end(), bytes[k].begin(), 0);
          };
          EXPECT_GT(dot(i), dot(j)) << q << " " << i << " " << j;
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 5000);
}

TEST(SurfDescriptor, BytesHaveNearlyConstantLengthBelow128) {
  const IntegralImage integral(textured());
  for (const Keypoint& keypoint : sample_keypoints()) {
    const auto bytes = bytes_of(surf_descriptor(integral, keypoint));
    const double norm = std::sqrt(
        static_cast<double>(std::inner_product(bytes.begin(), bytes.end(), bytes.begin(), 0)));
    EXPECT_NEAR(norm, 256.0, 4.0);
    EXPECT_LE(*std::max_element(bytes.begin(), bytes.end()), 127);
  }
}

TEST(SurfDescriptor, TurnedWindowOnTurnedImageGivesTheSameDescriptor) {
  const IntegralImage upright(textured());
  const auto reference =
      widened(surf_descriptor(upright, {.x_px = 128.0F, .y_px = 128.0F, .scale_px = 3.0F}));
  for (const double angle_deg : {30.0, 90.0, 145.0, 300.0}) {
    const double angle = angle_deg * kPi / 180.0;
    const IntegralImage turned(textured(angle));
    const auto same = widened(surf_descriptor(turned,
                                              {.x_px = 128.0F,
                                               .y_px = 128.0F,
                                               .scale_px = 3.0F,
                                               .angle_rad = static_cast<float>(angle)}));
    EXPECT_LT(distance(reference, same), 0.12) << angle_deg;
  }
}

TEST(SurfDescriptor, TinyTurnAgreesWithTheUprightPath) {
  const IntegralImage integral(textured());
  Keypoint keypoint{.x_px = 120.3F, .y_px = 131.8F, .scale_px = 2.4F};
  const auto upright = widened(surf_descriptor(integral, keypoint));
  keypoint.angle_rad = 1e-5F;
  EXPECT_LT(distance(upright, widened(surf_descriptor(integral, keypoint))), 1e-3);
}

TEST(SurfDescriptor, FlatImageGivesZeros) {
  const IntegralImage integral(cv::Mat(64, 64, CV_8UC1, cv::Scalar(90)));
  for (const float angle : {0.0F, 0.5F}) {
    const auto bytes = bytes_of(surf_descriptor(
        integral, {.x_px = 32.0F, .y_px = 32.0F, .scale_px = 2.0F, .angle_rad = angle}));
    EXPECT_TRUE(std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t b) { return b == 0; }));
  }
}

TEST(SurfDescriptor, WindowLargerThanTheImageIsDescribedWithoutFault) {
  const IntegralImage integral(
      render(random_texture(10, 20.0, 2), {.shift_x = 10.0, .shift_y = 10.0}, 20, 20));
  const auto d = widened(surf_descriptor(
      integral, {.x_px = 2.0F, .y_px = 18.0F, .scale_px = 9.0F, .angle_rad = 1.0F}));
  EXPECT_TRUE(std::all_of(d.begin(), d.end(), [](double v) { return v >= 0.0 && v <= 1.0; }));
}

/// A linear ramp of grey in one direction.
cv::Mat ramp(double angle_rad) {
  cv::Mat image(101, 101, CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double t = (x - 50) * std::cos(angle_rad) + (y - 50) * std::sin(angle_rad);
      image.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>(std::clamp(std::lround(128.0 + 1.5 * t), 0L, 255L));
    }
  }
  return image;
}

TEST(SurfOrientation, PointsUpTheGradient) {
  for (int degrees = -175; degrees <= 180; degrees += 15) {
    const double angle = degrees * kPi / 180.0;
    const double found = static_cast<double>(surf_orientation(
        IntegralImage(ramp(angle)), {.x_px = 50.0F, .y_px = 50.0F, .scale_px = 2.0F}));
    EXPECT_NEAR(std::remainder(found - angle, 2.0 * kPi), 0.0, 0.01) << degrees;
  }
}

TEST(SurfOrientation, TurnsWithTheImage) {
  const IntegralImage reference(textured());
  for (const double degrees : {20.0, 77.0, 180.0, 260.0}) {
    const double angle = degrees * kPi / 180.0;
    const IntegralImage turned(textured(angle));
    int agreeing = 0;
    const auto keypoints = sample_keypoints();
    for (const Keypoint& keypoint : keypoints) {
      const double x = static_cast<double>(keypoint.x_px) - 128.0;
      const double y = static_cast<double>(keypoint.y_px) - 128.0;
      Keypoint moved = keypoint;
      moved.x_px = static_cast<float>(std::cos(angle) * x - std::sin(angle) * y + 128.0);
      moved.y_px = static_cast<float>(std::sin(angle) * x + std::cos(angle) * y + 128.0);
      const double change = static_cast<double>(surf_orientation(turned, moved)) -
                            static_cast<double>(surf_orientation(reference, keypoint));
      agreeing += std::abs(std::remainder(change - angle, 2.0 * kPi)) < 0.25 ? 1 : 0;
    }
    // Arbitrary places, not blobs: some have two directions of nearly equal strength.
    EXPECT_GE(agreeing, static_cast<int>(keypoints.size()) * 6 / 10) << degrees;
  }
}

TEST(SurfOrientation, IsDefinedAtTheBorderAndZeroWhereFlat) {
  EXPECT_NEAR(
      surf_orientation(IntegralImage(ramp(0.7)), {.x_px = 3.0F, .y_px = 50.0F, .scale_px = 2.0F}),
      0.7F,
      0.3F);
  const IntegralImage flat(cv::Mat(64, 64, CV_8UC1, cv::Scalar(200)));
  EXPECT_EQ(surf_orientation(flat, {.x_px = 32.0F, .y_px = 32.0F, .scale_px = 2.0F}), 0.0F);
}

}  // namespace
}  // namespace trigmesh
