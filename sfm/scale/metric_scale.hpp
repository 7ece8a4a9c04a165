#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "sfm/calibration/aruco.hpp"
#include "sfm/geometry/similarity.hpp"
#include "sfm/scale/known_lengths.hpp"
#include "sfm/scale/square_fit.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// Markers by number, as a scene sees them.
using FittedMarkers = std::map<int, SquareFit>;

/// Measures every marker that a view with a pose sees. `detections`: per view of the scene what was
/// found in its picture.
[[nodiscard]] FittedMarkers fit_markers(const Scene& scene,
                                        std::span<const std::vector<MarkerDetection>> detections,
                                        const SquareFitOptions& options = {});

/// One known length as the scene sees it.
struct LengthEvidence {
  std::string name;  ///< "marker 3" for its side, "markers 0 and 1" for a distance
  double known_m = 0.0;
  double metres_per_unit = 0.0;
  double sd_ratio = 0.0;       ///< standard deviation of the measurement, as a part of it
  double edge_sd_ratio = 0.0;  ///< see SquareFit; none for a distance
};

enum class ScaleOutcome {
  kOk,
  kNothingMeasured,  ///< no known length could be measured
  kDisagreement,     ///< two known lengths differ by more than their accuracy: one is wrong
};

/// "ok", "nothing_measured", "disagreement".
[[nodiscard]] std::string_view to_string(ScaleOutcome outcome);

/// The unit of a scene in metres.
struct ScaleEstimate {
  ScaleOutcome outcome = ScaleOutcome::kNothingMeasured;
  std::vector<LengthEvidence> lengths;  ///< those that could be measured: sides, then distances
  double metres_per_unit = 0.0;         ///< kOk only, as the next
  /// Standard deviation, as a part of the scale: from the parts, inflated when they scatter more
  /// than they say (square root of the reduced chi square); and what they have in common, the place
  /// of edges and kKnownLengthSdRatio, for which the lengths of one card are taken to err
  /// together.
  double sd_ratio = 0.0;
  /// kDisagreement: the lengths in two groups by what they say, split where they are furthest
  /// apart, the smaller group first; positions in `lengths`.
  std::vector<std::size_t> odd_ones;
  std::vector<std::size_t> others;
};

/// Weighs what the known lengths say of the scale: mean of logarithms with weights of the inverse
/// variances. Two lengths disagree when they differ by more than three standard deviations of their
/// difference and by more than 1 %.
[[nodiscard]] ScaleEstimate estimate_scale(const FittedMarkers& markers, const KnownLengths& known);

enum class UpOutcome {
  kOk,
  kNoMarker,      ///< no marker could be measured
  kDisagreement,  ///< two markers look to different sides: they do not all lie flat
};

/// Where markers that lie flat look.
struct UpEstimate {
  UpOutcome outcome = UpOutcome::kNoMarker;
  /// World axes of the card in the scene: x along the upper edge of the marker with the smallest
  /// number, z up; origin in the middle of the markers. Rigid.
  Rigid3 card_from_world;
  double sd_rad = 0.0;             ///< standard deviation of up about one axis
  double largest_angle_rad = 0.0;  ///< between two markers
};

/// Mean direction of the markers that `known` names, weighed by their accuracy. They disagree when
/// two differ by more than three standard deviations and by more than 5 degrees.
[[nodiscard]] UpEstimate estimate_up(const FittedMarkers& markers, const KnownLengths& known);

/// World in metres from the scene's: the scale alone, about its origin, or also the axes of the
/// card.
[[nodiscard]] Sim3 metric_from_world(double metres_per_unit,
                                     const std::optional<UpEstimate>& up = std::nullopt);

}  // namespace trigmesh
