// A square of unknown place and size in views of known pose. With the corners c_k of the unit
// square around the origin, side s, pose (R, t) and view i's projection p_i:
//
//   minimise over R, t, s  sum_i sum_k | p_i(R s c_k + t) - x_ik |^2
//
// by Levenberg-Marquardt in seven unknowns; s is moved by its logarithm, R by a rotation on its
// right. With H = J^T J, and H_i and gradient g_i of view i alone, the change without view i is
// d_i = (H - H_i)^-1 g_i; the covariance is the jackknife's over views, which counts a view whose
// corners err together once:
//
//   C = (n - 1) / n  sum_i d_i d_i^T
//
// (J. G. MacKinnon, H. White, "Some heteroskedasticity-consistent covariance matrix estimators with
// improved finite sample properties", Journal of Econometrics 29, 1985, by groups), and never less
// than that of independent corners, sigma^2 H^-1, which few views may underrun by chance.
#include "sfm/scale/square_fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/LU>

#include "sfm/geometry/levenberg_marquardt.hpp"
#include "sfm/geometry/similarity.hpp"
#include "sfm/geometry/triangulation.hpp"

namespace trigmesh {
namespace {

constexpr int kDof = 7;  ///< rotation in the marker's frame, translation, logarithm of the side
constexpr int kSideAt = 6;
constexpr std::size_t kCorners = 4;
// Of the rule by which calibration puts views aside.
constexpr double kOutlierRatio = 3.0;
constexpr double kOutlierFloorPx = 0.5;
constexpr double kLeastVariancePx2 = 1e-12;  ///< of corners without any error

using Equations = NormalEquations<kDof>;
using Covariance = Eigen::Matrix<double, kDof, kDof>;

/// Corners of the unit square, x right, y up, in the order of the sightings.
const std::array<Eigen::Vector3d, kCorners>& unit_corners() {
  static const std::array<Eigen::Vector3d, kCorners> kUnit{
      Eigen::Vector3d{-0.5, 0.5, 0.0}, {0.5, 0.5, 0.0}, {0.5, -0.5, 0.0}, {-0.5, -0.5, 0.0}};
  return kUnit;
}

struct Square {
  Rigid3 world_from_marker;
  double side = 1.0;

  [[nodiscard]] Eigen::Vector3d corner(std::size_t k) const {
    return world_from_marker * (side * unit_corners()[k]);
  }
};

/// A sighting with the camera and the pose of its view.
struct PosedSighting {
  const Camera* camera;
  Rigid3 cam_from_world;
  const std::array<Eigen::Vector2d, kCorners>* corners_px;
};

std::vector<PosedSighting> posed(const Scene& scene, std::span<const MarkerSighting> sightings) {
  std::vector<PosedSighting> result;
  for (const MarkerSighting& sighting : sightings) {
    const View& view = scene.views[index(sighting.view)];
    if (view.cam_from_world) {
      result.push_back(
          {&scene.cameras[index(view.camera)], *view.cam_from_world, &sighting.corners_px});
    }
  }
  return result;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// The equations of one view; nothing where a corner does not project.
std::optional<Equations> linearize(const Square& square, const PosedSighting& sighting) {
  Equations equations;
  const Eigen::Matrix3d world_from_marker = square.world_from_marker.rotation.toRotationMatrix();
  const Eigen::Matrix3d cam_from_world = sighting.cam_from_world.rotation.toRotationMatrix();
  for (std::size_t k = 0; k < kCorners; ++k) {
    const auto seen =
        project_with_derivatives(*sighting.camera, sighting.cam_from_world * square.corner(k));
    if (!seen) {
      return std::nullopt;
    }
    const Eigen::Vector3d in_marker = square.side * unit_corners()[k];
    Eigen::Matrix<double, 3, kDof> d_point;
    d_point << -world_from_marker * cross_matrix(in_marker), Eigen::Matrix3d::Identity(),
        world_from_marker * in_marker;
    const Eigen::Matrix<double, 2, kDof> jacobian = seen->d_point * cam_from_world * d_point;
    const Eigen::Vector2d residual = seen->pixel - (*sighting.corners_px)[k];
    equations.add(jacobian, residual, 1.0);
    equations.cost += residual.squaredNorm();
  }
  return equations;
}

Square moved(const Square& square, const Eigen::Matrix<double, kDof, 1>& delta) {
  Square next = square;
  const Eigen::Vector3d turn = delta.head<3>();
  const double angle = turn.norm();
  if (angle > 0.0) {
    next.world_from_marker.rotation = (square.world_from_marker.rotation *
                                       Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)))
                                          .normalized();
  }
  next.world_from_marker.translation += delta.segment<3>(3);
  next.side *= std::exp(delta[kSideAt]);
  return next;
}

std::optional<Square> refine(const Square& start, const std::vector<PosedSighting>& views) {
  const auto equations = [&](const Square& square) -> std::optional<Equations> {
    Equations sum;
    for (const PosedSighting& view : views) {
      const auto one = linearize(square, view);
      if (!one) {
        return std::nullopt;
      }
      sum.jtj += one->jtj;
      sum.jtr += one->jtr;
      sum.cost += one->cost;
    }
    return sum;
  };
  const auto result = levenberg_marquardt<kDof>(
      start, equations, moved, {.max_iterations = 30, .relative_tolerance = 1e-12});
  return result.usable ? std::optional(result.state) : std::nullopt;
}

/// Root mean square distance of the corners in a view.
double rms_px(const Square& square, const PosedSighting& view) {
  const auto equations = linearize(square, view);
  return equations ? std::sqrt(equations->cost / kCorners)
                   : std::numeric_limits<double>::infinity();
}

/// What it means for the square when a corner has no place.
SquareOutcome outcome_of(TriangulationOutcome corner) {
  return corner == TriangulationOutcome::kLargeError ? SquareOutcome::kInconsistent
                                                     : SquareOutcome::kSmallAngle;
}

/// A square through the corners triangulated one by one; keeps the views that agree on all four.
tl::expected<Square, SquareOutcome> start_from_corners(std::vector<PosedSighting>& views,
                                                       const SquareFitOptions& options) {
  const TriangulationOptions triangulation{
      .min_angle_rad = 0.0, .max_error_px = options.max_error_px, .min_inliers = options.min_views};
  std::vector<std::size_t> agreements(views.size(), 0);
  std::array<Eigen::Vector3d, kCorners> corners;
  for (std::size_t k = 0; k < kCorners; ++k) {
    std::vector<Sighting> sightings;
    std::vector<std::size_t> view_of_sighting;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (const auto sighting =
              make_sighting(*views[i].camera, views[i].cam_from_world, (*views[i].corners_px)[k])) {
        sightings.push_back(*sighting);
        view_of_sighting.push_back(i);
      }
    }
    const RobustTriangulation found = triangulate_robust(sightings, triangulation);
    if (found.best.outcome != TriangulationOutcome::kOk) {
      return tl::unexpected(outcome_of(found.best.outcome));
    }
    corners[k] = found.best.point_in_world;
    for (std::size_t j = 0; j < sightings.size(); ++j) {
      agreements[view_of_sighting[j]] += found.inliers[j] != 0 ? 1U : 0U;
    }
  }
  const Alignment square = align_points(unit_corners(), corners, ScaleMode::kEstimated);
  if (square.outcome != AlignmentOutcome::kOk) {
    return tl::unexpected(SquareOutcome::kInconsistent);
  }
  std::vector<PosedSighting> agreeing;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (agreements[i] == kCorners) {
      agreeing.push_back(views[i]);
    }
  }
  views = std::move(agreeing);
  return Square{{square.b_from_a.rotation, square.b_from_a.translation}, square.b_from_a.scale};
}

/// Puts aside the views that are much worse than most; whether there were any.
bool drop_outliers(const Square& square, std::vector<PosedSighting>& views) {
  std::vector<double> errors;
  for (const PosedSighting& view : views) {
    errors.push_back(rms_px(square, view));
  }
  std::vector<double> sorted = errors;
  const auto middle = sorted.begin() + std::ssize(sorted) / 2;
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double limit = std::max(kOutlierRatio * *middle, kOutlierFloorPx);
  std::vector<PosedSighting> kept;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (errors[i] <= limit) {
      kept.push_back(views[i]);
    }
  }
  const bool dropped = kept.size() < views.size();
  views = std::move(kept);
  return dropped;
}

/// Largest angle between two directions from `place` to the cameras.
double spread_rad(const Eigen::Vector3d& place, const std::vector<PosedSighting>& views) {
  double largest = 0.0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = i + 1; j < views.size(); ++j) {
      largest = std::max(largest,
                         triangulation_angle(camera_center(views[i].cam_from_world),
                                             camera_center(views[j].cam_from_world),
                                             place));
    }
  }
  return largest;
}

/// The larger of both covariances, by the variance of each unknown; see the head of the file.
Covariance covariance_of(const std::vector<Equations>& views) {
  Covariance information = Covariance::Zero();
  double cost = 0.0;
  for (const Equations& view : views) {
    information += view.jtj.selfadjointView<Eigen::Lower>();
    cost += view.cost;
  }
  const auto count = static_cast<double>(views.size());
  const double variance_px2 = std::max(cost / (2.0 * kCorners * count - kDof), kLeastVariancePx2);
  const Covariance independent = variance_px2 * information.inverse();
  Covariance grouped = Covariance::Zero();
  for (const Equations& view : views) {
    const Covariance own = view.jtj.selfadjointView<Eigen::Lower>();
    const Eigen::Matrix<double, kDof, 1> change = (information - own).ldlt().solve(view.jtr);
    grouped += (count - 1.0) / count * change * change.transpose();
  }
  const Eigen::Matrix<double, kDof, 1> deviation =
      independent.diagonal().cwiseMax(grouped.diagonal()).cwiseSqrt();
  const Eigen::Matrix<double, kDof, 1> inflation =
      deviation.cwiseQuotient(independent.diagonal().cwiseSqrt());
  return inflation.asDiagonal() * independent * inflation.asDiagonal();
}

/// Fills what a square and its views tell.
void measure(const Square& square, const std::vector<PosedSighting>& views, SquareFit& fit) {
  std::vector<Equations> equations;
  double cost = 0.0;
  double side_px = 0.0;
  for (const PosedSighting& view : views) {
    equations.push_back(*linearize(square, view));  // refine has been here
    cost += equations.back().cost;
    for (std::size_t k = 0; k < kCorners; ++k) {
      side_px += ((*view.corners_px)[k] - (*view.corners_px)[(k + 1) % kCorners]).norm();
    }
  }
  const auto corners = static_cast<double>(kCorners * views.size());
  const Covariance covariance = covariance_of(equations);
  fit.rms_px = std::sqrt(cost / corners);
  fit.edge_sd_ratio = 2.0 * kEdgePlaceSdPx * corners / side_px;
  fit.world_from_marker = square.world_from_marker;
  fit.side = square.side;
  fit.side_sd_ratio = std::sqrt(covariance(kSideAt, kSideAt));
  fit.normal_sd_rad = std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1)));
  fit.center_covariance = covariance.block<3, 3>(3, 3);
}

}  // namespace

std::string_view to_string(SquareOutcome outcome) {
  switch (outcome) {
    case SquareOutcome::kOk:
      return "ok";
    case SquareOutcome::kTooFewViews:
      return "too_few_views";
    case SquareOutcome::kSmallAngle:
      return "small_angle";
    case SquareOutcome::kInconsistent:
      break;
  }
  return "inconsistent";
}

SquareFit fit_square(const Scene& scene,
                     std::span<const MarkerSighting> sightings,
                     const SquareFitOptions& options) {
  std::vector<PosedSighting> views = posed(scene, sightings);
  SquareFit fit;
  fit.views_seen = views.size();
  if (views.size() < options.min_views) {
    return fit;
  }
  const auto enough = [&] {
    return views.size() >= options.min_views &&
           static_cast<double>(views.size()) >=
               options.min_agreeing_ratio * static_cast<double>(fit.views_seen);
  };
  const auto start = start_from_corners(views, options);
  fit.outcome = start ? SquareOutcome::kInconsistent : start.error();
  std::optional<Square> square = start ? std::optional(*start) : std::nullopt;
  do {
    fit.views_used = views.size();
    if (!square || !enough()) {
      return fit;
    }
    fit.angle_rad = spread_rad(square->world_from_marker.translation, views);
    if (fit.angle_rad < options.min_angle_rad) {
      fit.outcome = SquareOutcome::kSmallAngle;
      return fit;
    }
    square = refine(*square, views);
  } while (!square || drop_outliers(*square, views));
  measure(*square, views, fit);
  fit.outcome = SquareOutcome::kOk;
  return fit;
}

}  // namespace trigmesh
