// After Waechter, Moehrle, Goesele, "Let There Be Color! Large-Scale Texturing of 3D
// Reconstructions", ECCV 2014, section 4.1 (photo-consistency check), started from the median.
#include "sfm/texture/color_outliers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include <Eigen/Core>
#include <Eigen/LU>

namespace trigmesh {
namespace {

constexpr std::size_t kFewestViews = 4;
constexpr int kIterations = 10;
constexpr float kColorNoise = 6.0F;  // grey levels that honest views differ by at least
constexpr float kGate = 10.2F;       // squared Mahalanobis distance: -2 ln(0.006), as in the paper
constexpr float kAgreement = 25.0F;  // grey levels at which quality falls to 1/e^0.5
constexpr std::size_t kBlock = 4096;

Eigen::Vector3f median_color(const std::vector<Eigen::Vector3f>& colors) {
  Eigen::Vector3f result;
  std::vector<float> values(colors.size());
  for (Eigen::Index c = 0; c < 3; ++c) {
    std::transform(
        colors.begin(), colors.end(), values.begin(), [c](const auto& v) { return v[c]; });
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    result[c] = *middle;
  }
  return result;
}

struct Gaussian {
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  Eigen::Matrix3f precision = Eigen::Matrix3f::Identity();
};

Gaussian fit(const std::vector<Eigen::Vector3f>& colors, const std::vector<std::uint8_t>& inside) {
  Gaussian result;
  float count = 0.0F;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    if (inside[i] != 0) {
      result.mean += colors[i];
      count += 1.0F;
    }
  }
  result.mean /= count;
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();
  for (std::size_t i = 0; i < colors.size(); ++i) {
    if (inside[i] != 0) {
      const Eigen::Vector3f d = colors[i] - result.mean;
      covariance += d * d.transpose() / count;
    }
  }
  covariance.diagonal().array() += kColorNoise * kColorNoise;
  result.precision = covariance.inverse();
  return result;
}

/// Which colours belong to the majority; all, when there is none.
std::vector<std::uint8_t> majority(const std::vector<Eigen::Vector3f>& colors) {
  const std::vector<std::uint8_t> everyone(colors.size(), 1);
  if (colors.size() < kFewestViews) {
    return everyone;
  }
  Gaussian model;
  model.mean = median_color(colors);
  // Start narrow: a wide start would let outliers widen the Gaussian around themselves.
  model.precision /= 4.0F * kColorNoise * kColorNoise;
  std::vector<std::uint8_t> inside(colors.size(), 0);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<std::uint8_t> next(colors.size(), 0);
    for (std::size_t i = 0; i < colors.size(); ++i) {
      const Eigen::Vector3f d = colors[i] - model.mean;
      next[i] = d.dot(model.precision * d) <= kGate ? 1 : 0;
    }
    if (static_cast<std::size_t>(std::count(next.begin(), next.end(), 1)) * 2 <= colors.size()) {
      return everyone;
    }
    if (next == inside) {
      break;
    }
    inside = std::move(next);
    model = fit(colors, inside);
  }
  return inside;
}

/// Marks the rejected entries of one face with quality 0 and weights the others by agreement.
void judge_face(std::span<FaceView> views, const std::vector<ColorGain>& gains) {
  std::vector<Eigen::Vector3f> colors;
  colors.reserve(views.size());
  for (const FaceView& view : views) {
    const std::array<float, 3> color = leveled_color(view, gains);
    colors.emplace_back(color[0], color[1], color[2]);
  }
  if (colors.size() < 3) {
    return;
  }
  const std::vector<std::uint8_t> inside = majority(colors);
  const Eigen::Vector3f center = median_color(colors);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const float distance = (colors[i] - center).norm() / kAgreement;
    views[i].quality *= inside[i] != 0 ? std::exp(-0.5F * distance * distance) : 0.0F;
  }
}

}  // namespace

OutlierRejection reject_color_outliers(const FaceViews& faces,
                                       const std::vector<ColorGain>& gains,
                                       Executor& executor) {
  std::vector<FaceView> judged = faces.entries;
  const std::size_t face_count = faces.face_count();
  executor.for_each_index((face_count + kBlock - 1) / kBlock, [&](std::size_t block) {
    const std::size_t end = std::min(face_count, (block + 1) * kBlock);
    for (std::size_t f = block * kBlock; f < end; ++f) {
      judge_face(
          std::span(judged).subspan(faces.offsets[f], faces.offsets[f + 1] - faces.offsets[f]),
          gains);
    }
  });
  OutlierRejection result;
  result.faces.offsets.reserve(face_count + 1);
  result.faces.offsets.push_back(0);
  std::size_t kept = 0;
  for (std::size_t f = 0; f < face_count; ++f) {
    for (std::size_t i = faces.offsets[f]; i < faces.offsets[f + 1]; ++i) {
      if (judged[i].quality > 0.0F) {
        judged[kept++] = judged[i];
      }
    }
    result.faces.offsets.push_back(kept);
  }
  result.rejected_count = judged.size() - kept;
  judged.resize(kept);
  result.faces.entries = std::move(judged);
  return result;
}

}  // namespace trigmesh
