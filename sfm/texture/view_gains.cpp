// Minimises, for each channel, over log-gains a_v and face colours m_f
//   sum_f sum_v rho(log c_fv + a_v - m_f) + lambda sum_v a_v^2
// by iterated reweighted least squares with Cauchy weights; m_f is eliminated in closed form.
// After Brown, Lowe, "Automatic Panoramic Image Stitching using Invariant Features", IJCV 2007,
// section 6 (gain compensation), on logarithms.
#include "sfm/texture/view_gains.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace trigmesh {
namespace {

constexpr std::size_t kMostFaces = 30'000;
constexpr int kIterations = 6;
constexpr double kResidualScale = 0.06;  // log units: about 6 % of brightness
constexpr double kPrior = 1e-3;          // share of a view's data weight that pulls to gain 1
constexpr float kDarkest = 10.0F;        // grey levels; below, the logarithm is all noise
constexpr float kBrightest = 245.0F;     // above, the sensor may have been saturated

struct LogColor {
  Eigen::Index view = 0;
  double value = 0.0;
};

std::vector<LogColor> log_colors(std::span<const FaceView> views, std::size_t channel) {
  std::vector<LogColor> result;
  for (const FaceView& view : views) {
    const float value = static_cast<float>(view.color[channel]) / kColorUnits;
    if (value >= kDarkest && value <= kBrightest) {
      result.push_back(
          {static_cast<Eigen::Index>(view.view), std::log(static_cast<double>(value))});
    }
  }
  return result;
}

double median_residual(const std::vector<LogColor>& colors, const Eigen::VectorXd& gains) {
  std::vector<double> values;
  values.reserve(colors.size());
  for (const LogColor& color : colors) {
    values.push_back(color.value + gains[color.view]);
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Normal equations of one reweighted step.
struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
};

void add_face(const std::vector<LogColor>& colors,
              const Eigen::VectorXd& gains,
              NormalEquations& equations) {
  const double center = median_residual(colors, gains);
  std::vector<double> weights(colors.size());
  double total = 0.0;
  double mean = 0.0;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const double r = (colors[i].value + gains[colors[i].view] - center) / kResidualScale;
    weights[i] = 1.0 / (1.0 + r * r);
    total += weights[i];
    mean += weights[i] * colors[i].value;
  }
  mean /= total;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const Eigen::Index vi = colors[i].view;
    equations.right[vi] -= weights[i] * (colors[i].value - mean);
    equations.matrix(vi, vi) += weights[i];
    for (std::size_t j = 0; j < colors.size(); ++j) {
      equations.matrix(vi, colors[j].view) -= weights[i] * weights[j] / total;
    }
  }
}

Eigen::VectorXd channel_log_gains(const FaceViews& faces,
                                  std::size_t view_count,
                                  std::size_t channel) {
  const auto n = static_cast<Eigen::Index>(view_count);
  const std::size_t stride = 1 + faces.face_count() / kMostFaces;
  Eigen::VectorXd gains = Eigen::VectorXd::Zero(n);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    NormalEquations equations{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
    for (std::size_t f = 0; f < faces.face_count(); f += stride) {
      const std::vector<LogColor> colors = log_colors(faces.of(f), channel);
      if (colors.size() >= 2) {
        add_face(colors, gains, equations);
      }
    }
    const double trace = std::max(equations.matrix.trace(), 1e-6);
    equations.matrix.diagonal().array() += kPrior * trace / static_cast<double>(n);
    gains = equations.matrix.ldlt().solve(equations.right);
  }
  return gains;
}

}  // namespace

std::vector<ColorGain> estimate_view_gains(const FaceViews& faces, std::size_t view_count) {
  std::vector<ColorGain> result(view_count, ColorGain{1.0F, 1.0F, 1.0F});
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const Eigen::VectorXd gains = channel_log_gains(faces, view_count, channel);
    for (std::size_t v = 0; v < view_count; ++v) {
      const double gain = std::exp(gains[static_cast<Eigen::Index>(v)]);
      result[v][channel] = static_cast<float>(std::clamp(gain, 0.4, 2.5));
    }
  }
  return result;
}

}  // namespace trigmesh
