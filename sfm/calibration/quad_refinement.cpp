#include "sfm/calibration/quad_refinement.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>

namespace trigmesh {
namespace {

constexpr double kSearchHalfLength_px = 3.0;
constexpr double kProfileStep_px = 0.5;
constexpr double kEndMargin_ratio = 0.12;  ///< the ends of a side are rounded off by blur
constexpr double kMinRise = 2.0;           ///< of 255, over one pixel
constexpr double kLargestMove_px = 4.0;
constexpr int kMinEdgePoints = 5;
constexpr int kMaxEdgePoints = 80;

template <typename T>
double sample(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  const double x = std::clamp(pixel.x(), 0.0, static_cast<double>(image.cols - 1));
  const double y = std::clamp(pixel.y(), 0.0, static_cast<double>(image.rows - 1));
  const int x0 = std::min(static_cast<int>(x), image.cols - 2);
  const int y0 = std::min(static_cast<int>(y), image.rows - 2);
  const double fx = x - x0;
  const double fy = y - y0;
  const T* upper = image.ptr<T>(y0) + x0;
  const T* lower = image.ptr<T>(y0 + 1) + x0;
  const auto mix = [&](const T* row) {
    return (1.0 - fx) * static_cast<double>(row[0]) + fx * static_cast<double>(row[1]);
  };
  return (1.0 - fy) * mix(upper) + fy * mix(lower);
}

/// Points x with normal . x = offset; |normal| = 1.
struct Line {
  Eigen::Vector2d normal;
  double offset = 0.0;
};

/// Total least squares line.
Line fit_line(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) {
    mean += p;
  }
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& p : points) {
    scatter += (p - mean) * (p - mean).transpose();
  }
  const Eigen::Vector2d normal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter).eigenvectors().col(0);
  return {.normal = normal, .offset = normal.dot(mean)};
}

std::optional<Line> side_line(const cv::Mat& light,
                              const Eigen::Vector2d& from,
                              const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double length = along.norm();
  // The image's y axis points down: for clockwise corners the outside lies to the left of the way.
  const Eigen::Vector2d outward = Eigen::Vector2d(along.y(), -along.x()) / length;
  const int count = std::clamp(static_cast<int>(length), kMinEdgePoints + 2, kMaxEdgePoints);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < count; ++i) {
    const double t = kEndMargin_ratio + (1.0 - 2.0 * kEndMargin_ratio) * i / (count - 1);
    const Eigen::Vector2d start = from + t * along;
    if (const auto offset = edge_offset(light, start, outward, kSearchHalfLength_px)) {
      points.emplace_back(start + *offset * outward);
    }
  }
  for (int round = 0; round < 3; ++round) {
    if (std::ssize(points) < kMinEdgePoints) {
      return std::nullopt;
    }
    const Line line = fit_line(points);
    std::vector<double> distances;
    for (const Eigen::Vector2d& p : points) {
      distances.push_back(std::abs(line.normal.dot(p) - line.offset));
    }
    std::vector<double> sorted = distances;
    std::nth_element(sorted.begin(), sorted.begin() + std::ssize(sorted) / 2, sorted.end());
    const double limit = std::max(0.15, 3.0 * sorted[sorted.size() / 2]);
    std::vector<Eigen::Vector2d> kept;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (distances[i] <= limit) {
        kept.push_back(points[i]);
      }
    }
    if (kept.size() == points.size()) {
      return line;
    }
    points = std::move(kept);
  }
  return fit_line(points);
}

std::optional<Eigen::Vector2d> intersection(const Line& a, const Line& b) {
  const double cross = a.normal.x() * b.normal.y() - a.normal.y() * b.normal.x();
  if (std::abs(cross) < 0.05) {
    return std::nullopt;
  }
  return Eigen::Vector2d((a.offset * b.normal.y() - b.offset * a.normal.y()) / cross,
                         (a.normal.x() * b.offset - b.normal.x() * a.offset) / cross);
}

}  // namespace

std::optional<double> edge_offset(const cv::Mat& light,
                                  const Eigen::Vector2d& start,
                                  const Eigen::Vector2d& outward,
                                  double half_length_px) {
  const int count = static_cast<int>(2.0 * half_length_px / kProfileStep_px) + 1;
  std::vector<double> rise(static_cast<std::size_t>(count));
  int steepest = 0;
  for (int k = 0; k < count; ++k) {
    const double t = -half_length_px + kProfileStep_px * k;
    rise[static_cast<std::size_t>(k)] = sample<float>(light, start + (t + 0.5) * outward) -
                                        sample<float>(light, start + (t - 0.5) * outward);
    if (rise[static_cast<std::size_t>(k)] > rise[static_cast<std::size_t>(steepest)]) {
      steepest = k;
    }
  }
  if (rise[static_cast<std::size_t>(steepest)] < kMinRise || steepest == 0 ||
      steepest == count - 1) {
    return std::nullopt;
  }
  // Centroid of the rise around its peak: unbiased for a blurred straight edge.
  double weight_sum = 0.0;
  double moment = 0.0;
  for (int k = std::max(0, steepest - 3); k <= std::min(count - 1, steepest + 3); ++k) {
    const double weight = std::max(0.0, rise[static_cast<std::size_t>(k)]);
    weight_sum += weight;
    moment += weight * (-half_length_px + kProfileStep_px * k);
  }
  return moment / weight_sum;
}

double sample_bilinear(const cv::Mat& image, const Eigen::Vector2d& pixel) {
  return image.type() == CV_8UC1 ? sample<std::uint8_t>(image, pixel) : sample<float>(image, pixel);
}

cv::Mat linear_light(const cv::Mat& grey, ToneCurve curve) {
  std::array<float, 256> light{};
  for (std::size_t i = 0; i < light.size(); ++i) {
    const double v = static_cast<double>(i) / 255.0;
    const double srgb = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
    light[i] = static_cast<float>(255.0 * (curve == ToneCurve::kSrgb ? srgb : v));
  }
  cv::Mat result(grey.rows, grey.cols, CV_32FC1);
  for (int y = 0; y < grey.rows; ++y) {
    const std::uint8_t* in = grey.ptr<std::uint8_t>(y);
    std::transform(
        in, in + grey.cols, result.ptr<float>(y), [&](std::uint8_t v) { return light[v]; });
  }
  return result;
}

std::optional<Quad> refine_dark_quad(const cv::Mat& light, const Quad& quad) {
  std::array<Line, 4> lines;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto line = side_line(light, quad[i], quad[(i + 1) % 4]);
    if (!line) {
      return std::nullopt;
    }
    lines[i] = *line;
  }
  Quad refined;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto corner = intersection(lines[(i + 3) % 4], lines[i]);
    if (!corner || (*corner - quad[i]).norm() > kLargestMove_px) {
      return std::nullopt;
    }
    refined[i] = *corner;
  }
  return refined;
}

}  // namespace trigmesh
