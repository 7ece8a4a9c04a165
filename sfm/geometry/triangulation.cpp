// A point from two or more views.
//
// Linear, homogeneous (R. Hartley, P. Sturm, "Triangulation", CVIU 1997, section 5.1): rows (u p3 -
// p1) X = 0 and (v p3 - p2) X = 0 of each view, X = eigenvector of the smallest eigenvalue of A^T
// A.
//
// Starting point of the refinement: the midpoint of all rays, sum_i w_i (I - d_i d_i^T)(X - c_i) =
// 0, with the weights 1 / distance^2 of one repetition that turn distances to rays into angles (K.
// Yang, W. Fang, Y. Zhao, N. Deng, "Iteratively Reweighted Midpoint Method for Fast Multiple View
// Triangulation", RA-L 2019). It is a 3x3 system, several times faster than the 4x4 eigenproblem
// and as good a start.
//
// Refinement: min_X sum_i | project_i(X) - x_i |^2 in pixels through the lens, by Gauss-Newton with
// damping.
#include "sfm/geometry/triangulation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "sfm/geometry/levenberg_marquardt.hpp"

namespace trigmesh {

namespace {

using Mask = std::span<const std::uint8_t>;  ///< empty: every sighting is used

bool used(Mask mask, std::size_t i) {
  return mask.empty() || mask[i] != 0;
}

Eigen::Vector3d in_camera(const Sighting& s, const Eigen::Vector3d& point) {
  return s.cam_from_world.leftCols<3>() * point + s.cam_from_world.col(3);
}

/// Unit direction of the ray in the world.
Eigen::Vector3d ray_in_world(const Sighting& s) {
  const Eigen::Vector3d ray(s.normalized.x(), s.normalized.y(), 1.0);
  return s.cam_from_world.leftCols<3>().transpose() * ray.normalized();
}

/// Sum over rays of w (I - d d^T) and w (I - d d^T) c, centres taken from `origin`.
struct RaySystem {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();

  void add(const Eigen::Vector3d& direction, const Eigen::Vector3d& center, double weight) {
    matrix.diagonal().array() += weight;
    matrix.noalias() -= weight * direction * direction.transpose();
    right += weight * (center - direction * direction.dot(center));
  }

  [[nodiscard]] std::optional<Eigen::Vector3d> solve() const {
    // Smallest pivot of parallel rays: the square of their angle, down to rounding.
    constexpr double kSmallestPivot = 1e-13;
    const Eigen::LDLT<Eigen::Matrix3d> factor(matrix);
    if (!(factor.vectorD().minCoeff() > kSmallestPivot * matrix.trace())) {
      return std::nullopt;
    }
    return factor.solve(right);
  }
};

/// Midpoint of the rays; nothing when they are parallel.
std::optional<Eigen::Vector3d> midpoint(std::span<const Sighting> sightings, Mask mask) {
  const Eigen::Vector3d origin = sightings.front().center_in_world;
  RaySystem plain;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (used(mask, i)) {
      plain.add(ray_in_world(sightings[i]), sightings[i].center_in_world - origin, 1.0);
    }
  }
  const auto first = plain.solve();
  if (!first) {
    return std::nullopt;
  }
  RaySystem weighted;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (used(mask, i)) {
      const Eigen::Vector3d center = sightings[i].center_in_world - origin;
      const double distance2 = (*first - center).squaredNorm();
      if (!(distance2 > 0.0)) {
        return Eigen::Vector3d(origin + *first);
      }
      weighted.add(ray_in_world(sightings[i]), center, 1.0 / distance2);
    }
  }
  return origin + weighted.solve().value_or(*first);
}

Eigen::Vector3d refine(std::span<const Sighting> sightings,
                       Mask mask,
                       const Eigen::Vector3d& start,
                       int max_steps) {
  const auto linearize = [&](const Eigen::Vector3d& point) -> std::optional<NormalEquations<3>> {
    NormalEquations<3> equations;
    for (std::size_t i = 0; i < sightings.size(); ++i) {
      if (!used(mask, i)) {
        continue;
      }
      const Sighting& s = sightings[i];
      const auto projection = project_with_derivatives(*s.camera, in_camera(s, point));
      if (!projection) {
        return std::nullopt;
      }
      const Eigen::Vector2d residual = projection->pixel - s.pixel;
      const Eigen::Matrix<double, 2, 3> jacobian =
          projection->d_point * s.cam_from_world.leftCols<3>();
      equations.add(jacobian, residual, 1.0);
      equations.cost += residual.squaredNorm();
    }
    return equations;
  };
  const auto step = [](const Eigen::Vector3d& point, const Eigen::Vector3d& delta) {
    return Eigen::Vector3d(point + delta);
  };
  return levenberg_marquardt<3>(
             start,
             linearize,
             step,
             {.max_iterations = max_steps, .relative_tolerance = 1e-6, .initial_damping = 1e-8})
      .state;
}

/// Squared reprojection error; infinite behind the camera.
double squared_error(const Sighting& s, const Eigen::Vector3d& point) {
  const Eigen::Vector3d point_in_cam = in_camera(s, point);
  // A pixel with plane coordinates was seen in front of the image plane, also by a fisheye.
  const auto pixel = point_in_cam.z() > 0.0 ? project(*s.camera, point_in_cam) : std::nullopt;
  return pixel ? (*pixel - s.pixel).squaredNorm() : std::numeric_limits<double>::infinity();
}

/// Largest angle at the point between the rays to two of the views used.
double largest_angle(std::span<const Sighting> sightings, Mask mask, const Eigen::Vector3d& point) {
  double smallest_cosine = 1.0;
  double angle = 0.0;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!used(mask, i)) {
      continue;
    }
    const Eigen::Vector3d first = (sightings[i].center_in_world - point).normalized();
    for (std::size_t j = i + 1; j < sightings.size(); ++j) {
      if (!used(mask, j)) {
        continue;
      }
      const Eigen::Vector3d second = (sightings[j].center_in_world - point).normalized();
      const double cosine = first.dot(second);
      if (cosine <= smallest_cosine) {
        smallest_cosine = cosine;
        angle = std::atan2(first.cross(second).norm(), cosine);
      }
    }
  }
  return angle;
}

/// Whether two of the views used stand apart.
bool has_baseline(std::span<const Sighting> sightings, Mask mask) {
  const Sighting* first = nullptr;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (!used(mask, i)) {
      continue;
    }
    if (first == nullptr) {
      first = &sightings[i];
    } else if (sightings[i].center_in_world != first->center_in_world) {
      return true;
    }
  }
  return false;
}

/// Fills errors and angle of a candidate and decides the outcome.
Triangulation judge(std::span<const Sighting> sightings,
                    Mask mask,
                    const Eigen::Vector3d& point,
                    const TriangulationOptions& options) {
  Triangulation result;
  result.point_in_world = point;
  result.angle_rad = largest_angle(sightings, mask, point);
  double sum = 0.0;
  double count = 0.0;
  bool behind = false;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (used(mask, i)) {
      behind = behind || in_camera(sightings[i], point).z() <= 0.0;
      const double error = std::sqrt(squared_error(sightings[i], point));
      result.max_error_px = std::max(result.max_error_px, error);
      sum += error;
      count += 1.0;
    }
  }
  result.mean_error_px = sum / count;
  if (behind) {
    result.outcome = TriangulationOutcome::kBehindCamera;
  } else if (result.angle_rad < options.min_angle_rad) {
    result.outcome = TriangulationOutcome::kSmallAngle;
  } else if (!(result.max_error_px <= options.max_error_px)) {
    result.outcome = TriangulationOutcome::kLargeError;
  } else {
    result.outcome = TriangulationOutcome::kOk;
  }
  return result;
}

Triangulation triangulate_used(std::span<const Sighting> sightings,
                               Mask mask,
                               const TriangulationOptions& options) {
  Triangulation result;
  if (!has_baseline(sightings, mask)) {
    return result;
  }
  const auto start = midpoint(sightings, mask);
  if (!start) {
    result.outcome = TriangulationOutcome::kSmallAngle;
    return result;
  }
  return judge(
      sightings, mask, refine(sightings, mask, *start, options.max_refinement_steps), options);
}

using ViewPair = std::pair<std::uint32_t, std::uint32_t>;

/// All pairs of views, or `limit` of them drawn at random when there are more.
std::vector<ViewPair> pairs_to_try(std::uint32_t views, std::size_t limit, std::uint64_t seed) {
  std::vector<ViewPair> pairs;
  const std::size_t all = std::size_t{views} * (views - 1) / 2;
  pairs.reserve(std::min(all, limit));
  if (all <= limit) {
    for (std::uint32_t i = 0; i < views; ++i) {
      for (std::uint32_t j = i + 1; j < views; ++j) {
        pairs.emplace_back(i, j);
      }
    }
    return pairs;
  }
  RandomGenerator random(seed);
  while (pairs.size() < limit) {
    const auto sample = sample_distinct<2>(random, views);
    pairs.emplace_back(std::min(sample[0], sample[1]), std::max(sample[0], sample[1]));
  }
  return pairs;
}

/// Midpoint of two rays that meet in front of both at an angle of at least `min_angle_rad`.
std::optional<Eigen::Vector3d> point_of_pair(const Sighting& first,
                                             const Sighting& second,
                                             double min_angle_rad) {
  const Eigen::Vector3d d1 = ray_in_world(first);
  const Eigen::Vector3d d2 = ray_in_world(second);
  if (d1.dot(d2) > std::cos(min_angle_rad)) {
    return std::nullopt;
  }
  RaySystem system;
  system.add(d1, Eigen::Vector3d::Zero(), 1.0);
  system.add(d2, second.center_in_world - first.center_in_world, 1.0);
  const auto offset = system.solve();
  if (!offset) {
    return std::nullopt;
  }
  return Eigen::Vector3d(first.center_in_world + *offset);
}

/// Truncated squares (MSAC; P. Torr, A. Zisserman, CVIU 2000); gives up once it exceeds `best`.
double truncated_cost(std::span<const Sighting> sightings,
                      const Eigen::Vector3d& point,
                      double max_error_px,
                      double best) {
  const double limit = max_error_px * max_error_px;
  double cost = 0.0;
  for (const Sighting& s : sightings) {
    cost += std::min(limit, squared_error(s, point));
    if (cost >= best) {
      break;
    }
  }
  return cost;
}

std::size_t mark_inliers(std::span<const Sighting> sightings,
                         const Eigen::Vector3d& point,
                         double max_error_px,
                         InlierMask& mask) {
  const double limit = max_error_px * max_error_px;
  std::size_t count = 0;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    mask[i] = squared_error(sightings[i], point) <= limit ? 1 : 0;
    count += mask[i];
  }
  return count;
}

/// Point of the best pair by truncated cost over all views; nothing when no pair of rays meets.
std::optional<Eigen::Vector3d> best_pair_point(std::span<const Sighting> sightings,
                                               const TriangulationOptions& options) {
  std::optional<Eigen::Vector3d> best;
  double best_cost = std::numeric_limits<double>::infinity();
  const auto views = static_cast<std::uint32_t>(sightings.size());
  for (const auto& [i, j] : pairs_to_try(views, options.max_pairs, options.seed)) {
    const auto point = point_of_pair(sightings[i], sightings[j], options.min_angle_rad);
    if (!point) {
      continue;
    }
    const double cost = truncated_cost(sightings, *point, options.max_error_px, best_cost);
    if (cost < best_cost) {
      best_cost = cost;
      best = point;
    }
  }
  return best;
}

struct AgreedPoint {
  Triangulation fit;
  InlierMask mask;  ///< the views that `fit` was computed from
  std::size_t count = 0;
};

/// Fits to the views that agree with the point and looks again who agrees, as long as they become
/// more.
AgreedPoint grow_agreement(std::span<const Sighting> sightings,
                           const Eigen::Vector3d& start,
                           const TriangulationOptions& options) {
  AgreedPoint agreed{{}, InlierMask(sightings.size(), 0)};
  agreed.count = mark_inliers(sightings, start, options.max_error_px, agreed.mask);
  InlierMask next(sightings.size(), 0);
  while (agreed.count >= 2) {
    agreed.fit = triangulate_used(sightings, agreed.mask, options);
    const std::size_t next_count =
        mark_inliers(sightings, agreed.fit.point_in_world, options.max_error_px, next);
    if (next_count <= agreed.count) {
      break;
    }
    agreed.mask = next;
    agreed.count = next_count;
  }
  return agreed;
}

}  // namespace

Result<> TriangulationOptions::validate() const {
  if (!(min_angle_rad >= 0.0 && min_angle_rad < std::numbers::pi)) {
    return fail(ErrorCode::kInvalidArgument,
                "triangulation min_angle_rad is {}, must be in [0, pi)",
                min_angle_rad);
  }
  if (!(max_error_px > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "triangulation max_error_px is {}, must be positive",
                max_error_px);
  }
  if (max_refinement_steps < 0) {
    return fail(ErrorCode::kInvalidArgument,
                "triangulation max_refinement_steps is {}, must not be negative",
                max_refinement_steps);
  }
  if (min_inliers < 2 || max_pairs < 1) {
    return fail(ErrorCode::kInvalidArgument,
                "triangulation min_inliers is {} and max_pairs {}, must be at least 2 and 1",
                min_inliers,
                max_pairs);
  }
  return {};
}

std::string_view to_string(TriangulationOutcome outcome) {
  switch (outcome) {
    case TriangulationOutcome::kOk:
      return "ok";
    case TriangulationOutcome::kBehindCamera:
      return "behind_camera";
    case TriangulationOutcome::kSmallAngle:
      return "small_angle";
    case TriangulationOutcome::kLargeError:
      return "large_error";
    case TriangulationOutcome::kDegenerate:
      return "degenerate";
  }
  return "unknown";
}

std::optional<Sighting> make_sighting(const Camera& camera,
                                      const Rigid3& cam_from_world,
                                      const Eigen::Vector2d& pixel) {
  const auto normalized = normalize_pixel(camera, pixel);
  if (!normalized) {
    return std::nullopt;
  }
  return Sighting{.camera = &camera,
                  .cam_from_world = cam_from_world.matrix(),
                  .center_in_world = camera_center(cam_from_world),
                  .pixel = pixel,
                  .normalized = *normalized};
}

double triangulation_angle(const Eigen::Vector3d& first_center,
                           const Eigen::Vector3d& second_center,
                           const Eigen::Vector3d& point) {
  const Eigen::Vector3d first = first_center - point;
  const Eigen::Vector3d second = second_center - point;
  return std::atan2(first.cross(second).norm(), first.dot(second));
}

std::optional<Eigen::Vector4d> triangulate_linear(std::span<const Sighting> sightings) {
  if (sightings.size() < 2) {
    return std::nullopt;
  }
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const Sighting& s : sightings) {
    for (Eigen::Index k = 0; k < 2; ++k) {
      const Eigen::RowVector4d row =
          s.normalized[k] * s.cam_from_world.row(2) - s.cam_from_world.row(k);
      normal.noalias() += row.transpose() * row;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(normal);
  return Eigen::Vector4d(solver.eigenvectors().col(0));
}

Triangulation triangulate(std::span<const Sighting> sightings,
                          const TriangulationOptions& options) {
  return triangulate_used(sightings, {}, options);
}

RobustTriangulation triangulate_robust(std::span<const Sighting> sightings,
                                       const TriangulationOptions& options) {
  RobustTriangulation result;
  result.inliers.assign(sightings.size(), 0);
  result.best = triangulate(sightings, options);
  if (result.best.outcome == TriangulationOutcome::kOk) {
    if (sightings.size() < options.min_inliers) {
      result.best.outcome = TriangulationOutcome::kLargeError;
      return result;
    }
    std::fill(result.inliers.begin(), result.inliers.end(), std::uint8_t{1});
    result.inlier_count = sightings.size();
    return result;
  }
  if (sightings.size() < 3 || result.best.outcome == TriangulationOutcome::kDegenerate) {
    return result;
  }
  const auto start = best_pair_point(sightings, options);
  if (!start) {
    return result;
  }
  const AgreedPoint agreed = grow_agreement(sightings, *start, options);
  if (agreed.fit.outcome == TriangulationOutcome::kOk && agreed.count >= options.min_inliers) {
    return {agreed.fit, agreed.mask, agreed.count};
  }
  return result;
}

}  // namespace trigmesh
