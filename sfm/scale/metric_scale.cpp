// Scale from known lengths L_i, which the scene sees as l_i +- sigma_i l_i units:
//
//   x_i = ln(L_i / l_i),  w_i = 1 / sigma_i^2,  ln(metres per unit) = sum w_i x_i / sum w_i
//   variance = max(1, chi^2 / (n - 1)) / sum w_i,  chi^2 = sum w_i (x_i - mean)^2
//
// plus the squares of what all lengths have in common: (sum w_i e_i / sum w_i)^2 of the place of
// edges, and the accuracy of lengths as a person knows them.
// The factor in front is R. T. Birge's: "The calculation of errors by the method of least squares",
// Physical Review 40, 1932. The same for directions, with two degrees of freedom each.
#include "sfm/scale/metric_scale.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr double kSignificance = 3.0;  ///< standard deviations of a difference
constexpr double kScaleDifference = 0.01;
constexpr double kUpDifferenceRad = 5.0 * std::numbers::pi / 180.0;

/// Birge's ratio squared, at least 1.
double inflation(double chi_square, std::size_t degrees_of_freedom) {
  return degrees_of_freedom == 0
             ? 1.0
             : std::max(1.0, chi_square / static_cast<double>(degrees_of_freedom));
}

double log_scale(const LengthEvidence& length) {
  return std::log(length.metres_per_unit);
}

void add_sides(const FittedMarkers& markers, const KnownLengths& known, ScaleEstimate& estimate) {
  for (const auto& [marker, fit] : markers) {
    const std::optional<double> side_m = known.side_m(marker);
    if (side_m && fit.outcome == SquareOutcome::kOk) {
      estimate.lengths.push_back({fmt::format("marker {}", marker),
                                  *side_m,
                                  *side_m / fit.side,
                                  fit.side_sd_ratio,
                                  fit.edge_sd_ratio});
    }
  }
}

void add_distances(const FittedMarkers& markers,
                   const KnownLengths& known,
                   ScaleEstimate& estimate) {
  for (const auto& [pair, metres] : known.distance_m) {
    const auto first = markers.find(pair.first);
    const auto second = markers.find(pair.second);
    if (first == markers.end() || second == markers.end() ||
        first->second.outcome != SquareOutcome::kOk ||
        second->second.outcome != SquareOutcome::kOk) {
      continue;
    }
    const Eigen::Vector3d between =
        second->second.world_from_marker.translation - first->second.world_from_marker.translation;
    const double units = between.norm();
    if (!(units > 0.0)) {
      continue;
    }
    const Eigen::Vector3d along = between / units;
    const double variance =
        along.dot((first->second.center_covariance + second->second.center_covariance) * along);
    estimate.lengths.push_back({fmt::format("markers {} and {}", pair.first, pair.second),
                                metres,
                                metres / units,
                                std::sqrt(variance) / units});
  }
}

bool disagree(const LengthEvidence& a, const LengthEvidence& b) {
  const double difference = std::abs(log_scale(a) - log_scale(b));
  const double edges = a.edge_sd_ratio - b.edge_sd_ratio;
  const double variance = a.sd_ratio * a.sd_ratio + b.sd_ratio * b.sd_ratio + edges * edges +
                          2.0 * kKnownLengthSdRatio * kKnownLengthSdRatio;
  return difference > kSignificance * std::sqrt(variance) && difference > kScaleDifference;
}

template <typename Items, typename Predicate>
bool any_pair(const Items& items, const Predicate& predicate) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    for (std::size_t j = i + 1; j < items.size(); ++j) {
      if (predicate(items[i], items[j])) {
        return true;
      }
    }
  }
  return false;
}

/// Splits the lengths, at least two, where what they say is furthest apart.
void split(ScaleEstimate& estimate) {
  std::vector<std::size_t> order(estimate.lengths.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto value = [&](std::size_t i) { return log_scale(estimate.lengths[i]); };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return value(a) < value(b);
  });
  std::size_t cut = 1;
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (value(order[i]) - value(order[i - 1]) > value(order[cut]) - value(order[cut - 1])) {
      cut = i;
    }
  }
  const auto middle = order.begin() + static_cast<std::ptrdiff_t>(cut);
  estimate.odd_ones.assign(order.begin(), middle);
  estimate.others.assign(middle, order.end());
  if (estimate.odd_ones.size() > estimate.others.size()) {
    std::swap(estimate.odd_ones, estimate.others);
  }
  std::sort(estimate.odd_ones.begin(), estimate.odd_ones.end());
  std::sort(estimate.others.begin(), estimate.others.end());
}

void combine(ScaleEstimate& estimate) {
  double weights = 0.0;
  double sum = 0.0;
  double edges = 0.0;
  for (const LengthEvidence& length : estimate.lengths) {
    const double weight = 1.0 / (length.sd_ratio * length.sd_ratio);
    weights += weight;
    sum += weight * log_scale(length);
    edges += weight * length.edge_sd_ratio;
  }
  const double mean = sum / weights;
  double chi_square = 0.0;
  for (const LengthEvidence& length : estimate.lengths) {
    const double deviation = (log_scale(length) - mean) / length.sd_ratio;
    chi_square += deviation * deviation;
  }
  const double variance = inflation(chi_square, estimate.lengths.size() - 1) / weights;
  estimate.metres_per_unit = std::exp(mean);
  estimate.sd_ratio = std::hypot(std::sqrt(variance), edges / weights, kKnownLengthSdRatio);
}

Eigen::Vector3d normal_of(const SquareFit& fit) {
  return fit.world_from_marker.rotation * Eigen::Vector3d::UnitZ();
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Axes with z up and x as near as may be to `x_hint`, rows in the world of `up`.
Eigen::Quaterniond axes_from_world(const Eigen::Vector3d& up, const Eigen::Vector3d& x_hint) {
  Eigen::Matrix3d axes;
  const Eigen::Vector3d y = up.cross(x_hint).normalized();
  axes << y.cross(up).transpose(), y.transpose(), up.transpose();
  return Eigen::Quaterniond(axes).normalized();
}

}  // namespace

std::string_view to_string(ScaleOutcome outcome) {
  switch (outcome) {
    case ScaleOutcome::kOk:
      return "ok";
    case ScaleOutcome::kNothingMeasured:
      return "nothing_measured";
    case ScaleOutcome::kDisagreement:
      break;
  }
  return "disagreement";
}

FittedMarkers fit_markers(const Scene& scene,
                          std::span<const std::vector<MarkerDetection>> detections,
                          const SquareFitOptions& options) {
  TM_CHECK(detections.size() == scene.views.size());
  std::map<int, std::vector<MarkerSighting>> sightings;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    if (!scene.views[i].cam_from_world) {
      continue;
    }
    for (const MarkerDetection& detection : detections[i]) {
      sightings[detection.id].push_back({id_of<ViewId>(i), detection.corners_px});
    }
  }
  FittedMarkers markers;
  for (const auto& [marker, seen] : sightings) {
    markers.emplace(marker, fit_square(scene, seen, options));
  }
  return markers;
}

ScaleEstimate estimate_scale(const FittedMarkers& markers, const KnownLengths& known) {
  ScaleEstimate estimate;
  add_sides(markers, known, estimate);
  add_distances(markers, known, estimate);
  if (estimate.lengths.empty()) {
    return estimate;
  }
  if (any_pair(estimate.lengths, disagree)) {
    estimate.outcome = ScaleOutcome::kDisagreement;
    split(estimate);
    return estimate;
  }
  estimate.outcome = ScaleOutcome::kOk;
  combine(estimate);
  return estimate;
}

UpEstimate estimate_up(const FittedMarkers& markers, const KnownLengths& known) {
  std::vector<SquareFit> used;
  for (const auto& [marker, fit] : markers) {
    if (known.names(marker) && fit.outcome == SquareOutcome::kOk) {
      used.push_back(fit);
    }
  }
  UpEstimate estimate;
  if (used.empty()) {
    return estimate;
  }
  const bool agree = !any_pair(used, [&](const SquareFit& a, const SquareFit& b) {
    const double angle = angle_between(normal_of(a), normal_of(b));
    estimate.largest_angle_rad = std::max(estimate.largest_angle_rad, angle);
    return angle > kUpDifferenceRad &&
           angle > kSignificance * std::hypot(a.normal_sd_rad, b.normal_sd_rad);
  });
  if (!agree) {
    estimate.outcome = UpOutcome::kDisagreement;
    return estimate;
  }
  double weights = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const SquareFit& fit : used) {
    const double weight = 1.0 / (fit.normal_sd_rad * fit.normal_sd_rad);
    weights += weight;
    sum += weight * normal_of(fit);
    middle += fit.world_from_marker.translation / static_cast<double>(used.size());
  }
  const Eigen::Vector3d up = sum.normalized();
  double chi_square = 0.0;
  for (const SquareFit& fit : used) {
    const double deviation = angle_between(normal_of(fit), up) / fit.normal_sd_rad;
    chi_square += deviation * deviation;
  }
  estimate.outcome = UpOutcome::kOk;
  estimate.sd_rad = std::sqrt(inflation(chi_square, 2 * (used.size() - 1)) / weights);
  const Eigen::Quaterniond rotation =
      axes_from_world(up, used.front().world_from_marker.rotation * Eigen::Vector3d::UnitX());
  estimate.card_from_world = {rotation, -(rotation * middle)};
  return estimate;
}

Sim3 metric_from_world(double metres_per_unit, const std::optional<UpEstimate>& up) {
  if (!up) {
    return {.scale = metres_per_unit};
  }
  const Rigid3& card_from_world = up->card_from_world;
  return {metres_per_unit, card_from_world.rotation, metres_per_unit * card_from_world.translation};
}

}  // namespace trigmesh
