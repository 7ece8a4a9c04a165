// After Waechter, Moehrle, Goesele, "Let There Be Color! Large-Scale Texturing of 3D
// Reconstructions", ECCV 2014, section 4.1 (photo-consistency check), started from the median. What
// is judged is not the colour of a face but its distance from the median of the views, smoothed
// over the faces around as this view sees them: fine patterns that no pose hits by the pixel differ
// from face to face with either sign, a thing that stands in the way does not.
#include "sfm/texture/color_outliers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include <Eigen/Core>
#include <Eigen/LU>

#include "sfm/texture/mesh_topology.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kFewestViews = 4;
constexpr int kIterations = 10;
constexpr int kSmoothings = 3;
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

/// Distance of a look's colour from the median over the views, 1/kResidualUnits grey levels.
using Residual = std::array<std::int16_t, 3>;
constexpr float kResidualUnits = 64.0F;

Residual to_residual(const Eigen::Vector3f& difference) {
  Residual result{};
  for (std::size_t c = 0; c < 3; ++c) {
    result[c] = static_cast<std::int16_t>(
        std::lround(difference[static_cast<Eigen::Index>(c)] * kResidualUnits));
  }
  return result;
}

Eigen::Vector3f to_color(const Residual& residual) {
  return Eigen::Vector3f(residual[0], residual[1], residual[2]) / kResidualUnits;
}

/// Runs `work(face)` for all faces, in blocks.
template <typename Work>
void for_each_face(std::size_t face_count, Executor& executor, const Work& work) {
  executor.for_each_index((face_count + kBlock - 1) / kBlock, [&](std::size_t block) {
    const std::size_t end = std::min(face_count, (block + 1) * kBlock);
    for (std::size_t f = block * kBlock; f < end; ++f) {
      work(f);
    }
  });
}

std::vector<Residual> residuals_of(const FaceViews& faces,
                                   const std::vector<ColorGain>& gains,
                                   Executor& executor) {
  std::vector<Residual> residuals(faces.entries.size());
  for_each_face(faces.face_count(), executor, [&](std::size_t f) {
    std::vector<Eigen::Vector3f> colors;
    for (const FaceView& view : faces.of(f)) {
      const std::array<float, 3> color = leveled_color(view, gains);
      colors.emplace_back(color[0], color[1], color[2]);
    }
    if (colors.empty()) {
      return;
    }
    const Eigen::Vector3f center = median_color(colors);
    for (std::size_t i = 0; i < colors.size(); ++i) {
      residuals[faces.offsets[f] + i] = to_residual(colors[i] - center);
    }
  });
  return residuals;
}

/// Means over each face and its neighbours, of the same view.
std::vector<Residual> smoothed(const FaceViews& faces,
                               const FaceNeighbors& neighbors,
                               const std::vector<Residual>& residuals,
                               Executor& executor) {
  std::vector<Residual> result(residuals.size());
  for_each_face(faces.face_count(), executor, [&](std::size_t f) {
    for (std::size_t i = faces.offsets[f]; i < faces.offsets[f + 1]; ++i) {
      const std::uint32_t view = faces.entries[i].view;
      Eigen::Vector3f sum = to_color(residuals[i]);
      float count = 1.0F;
      for (const std::uint32_t other : neighbors[f]) {
        if (other == kNoFace) {
          continue;
        }
        const auto looks = faces.of(other);
        const auto found = std::lower_bound(
            looks.begin(), looks.end(), view, [](const FaceView& look, std::uint32_t wanted) {
              return look.view < wanted;
            });
        if (found != looks.end() && found->view == view) {
          sum += to_color(
              residuals[faces.offsets[other] + static_cast<std::size_t>(found - looks.begin())]);
          count += 1.0F;
        }
      }
      result[i] = to_residual(sum / count);
    }
  });
  return result;
}

/// Marks the rejected entries of one face with quality 0 and weights the others by agreement.
void judge_face(std::span<FaceView> views, std::span<const Residual> residuals) {
  if (views.size() < 3) {
    return;
  }
  std::vector<Eigen::Vector3f> colors(residuals.size());
  std::transform(residuals.begin(), residuals.end(), colors.begin(), to_color);
  const std::vector<std::uint8_t> inside = majority(colors);
  const Eigen::Vector3f center = median_color(colors);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const float distance = (colors[i] - center).norm() / kAgreement;
    views[i].quality *= inside[i] != 0 ? std::exp(-0.5F * distance * distance) : 0.0F;
  }
}

}  // namespace

OutlierRejection reject_color_outliers(const FaceViews& faces,
                                       const FaceNeighbors& neighbors,
                                       const std::vector<ColorGain>& gains,
                                       Executor& executor) {
  std::vector<Residual> residuals = residuals_of(faces, gains, executor);
  for (int i = 0; i < kSmoothings; ++i) {
    residuals = smoothed(faces, neighbors, residuals, executor);
  }
  std::vector<FaceView> judged = faces.entries;
  const std::size_t face_count = faces.face_count();
  for_each_face(face_count, executor, [&](std::size_t f) {
    const std::size_t count = faces.offsets[f + 1] - faces.offsets[f];
    judge_face(std::span(judged).subspan(faces.offsets[f], count),
               std::span(residuals).subspan(faces.offsets[f], count));
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
