#include "sfm/dense/view_selection.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "firmware/base/check.hpp"
#include "sfm/dense/patch_match.hpp"

namespace trigmesh {

namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
/// Fewer points than this in a view are completed by points spread over its picture.
constexpr std::size_t kFewPoints = 30;
/// Points of a view that are looked at; more are thinned evenly.
constexpr std::size_t kManyPoints = 2000;
/// Cosine between the directions to two sources above which the second adds little.
constexpr double kSameSideCosine = 0.7;
constexpr double kSameSideWorth = 0.4;

/// The points that one view is judged by.
struct ViewPoints {
  std::vector<Eigen::Vector3d> seen;    ///< in world: its landmarks
  std::vector<std::size_t> landmark;    ///< their positions
  std::vector<Eigen::Vector3d> spread;  ///< in world: stand-ins where landmarks are few
};

double percentile(std::vector<double>& values, double part) {
  const auto at = static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// Depths of the points in front of a view.
std::vector<double> depths_of(const DenseView& view, std::span<const Eigen::Vector3d> points) {
  std::vector<double> depths;
  for (const Eigen::Vector3d& point : points) {
    const double z = (view.cam_from_world * point).z();
    if (z > 0.0) {
      depths.push_back(z);
    }
  }
  return depths;
}

bool in_picture(const DenseView& view, const Eigen::Vector3d& point_in_world) {
  const std::optional<Eigen::Vector2d> pixel =
      project(view.camera, view.cam_from_world * point_in_world);
  return pixel && pixel->x() >= 0.0 && pixel->y() >= 0.0 &&
         pixel->x() <= view.camera.width_px - 1 && pixel->y() <= view.camera.height_px - 1;
}

std::vector<Eigen::Vector3d> spread_points(const DenseView& view, double depth) {
  constexpr int kSteps = 6;
  std::vector<Eigen::Vector3d> points;
  const Rigid3 world_from_cam = view.cam_from_world.inverse();
  for (int row = 0; row < kSteps; ++row) {
    for (int column = 0; column < kSteps; ++column) {
      const double x = (column + 0.5) / kSteps * view.camera.width_px - 0.5;
      const double y = (row + 0.5) / kSteps * view.camera.height_px - 0.5;
      points.emplace_back(world_from_cam *
                          Eigen::Vector3d((x - view.camera.cx_px) / view.camera.fx_px * depth,
                                          (y - view.camera.cy_px) / view.camera.fy_px * depth,
                                          depth));
    }
  }
  return points;
}

/// All landmarks in the picture of a view, seen by it or not: the depth where its own are few.
std::vector<Eigen::Vector3d> landmarks_in_front(const Scene& scene, const DenseView& view) {
  std::vector<Eigen::Vector3d> points;
  for (const Landmark& landmark : scene.landmarks) {
    if (in_picture(view, landmark.position_in_world)) {
      points.push_back(landmark.position_in_world);
    }
  }
  return points;
}

ViewPoints points_of(const Scene& scene, const DenseView& view) {
  ViewPoints points;
  for (const LandmarkId id : scene.views[index(view.source)].landmarks) {
    if (id != kNoLandmark) {
      points.landmark.push_back(index(id));
    }
  }
  std::ranges::sort(points.landmark);
  const auto last = std::unique(points.landmark.begin(), points.landmark.end());
  points.landmark.erase(last, points.landmark.end());
  for (const std::size_t landmark : points.landmark) {
    points.seen.push_back(scene.landmarks[landmark].position_in_world);
  }
  if (points.seen.size() < kFewPoints) {
    std::vector<Eigen::Vector3d> usual = points.seen;
    if (usual.empty()) {
      usual = landmarks_in_front(scene, view);
    }
    std::vector<double> depths = depths_of(view, usual);
    if (!depths.empty()) {
      points.spread = spread_points(view, percentile(depths, 0.5));
    }
  }
  return points;
}

/// What one point adds to the worth of a source: by angle and by scale.
double worth_of_point(const DenseView& view,
                      const DenseView& source,
                      const Eigen::Vector3d& point,
                      const ViewSelectionOptions& options) {
  const Eigen::Vector3d here = camera_center(view.cam_from_world) - point;
  const Eigen::Vector3d there = camera_center(source.cam_from_world) - point;
  const double angle_deg = std::atan2(here.cross(there).norm(), here.dot(there)) * kDegPerRad;
  const double off = angle_deg - options.best_angle_deg;
  const double sigma = off < 0.0 ? options.narrow_sigma_deg : options.wide_sigma_deg;
  const double size_ratio =
      (here.norm() / view.camera.fx_px) / (there.norm() / source.camera.fx_px);
  const double scale = std::min({1.0, size_ratio * 1.2, 1.2 / size_ratio});
  return std::exp(-off * off / (2.0 * sigma * sigma)) * scale * scale;
}

double worth_of_source(std::span<const DenseView> views,
                       std::span<const ViewPoints> points,
                       std::size_t v,
                       std::size_t s,
                       const ViewSelectionOptions& options) {
  const ViewPoints& own = points[v];
  const ViewPoints& other = points[s];
  const std::size_t step = 1 + own.seen.size() / kManyPoints;
  double worth = 0.0;
  for (std::size_t i = 0; i < own.seen.size(); i += step) {
    if (std::ranges::binary_search(other.landmark, own.landmark[i])) {
      worth += worth_of_point(views[v], views[s], own.seen[i], options);
    }
  }
  constexpr double kStandInWorth = 0.2;  // a place that both pictures hold may be hidden in one
  for (const Eigen::Vector3d& point : own.spread) {
    const bool in_front = (views[s].cam_from_world.rotation *
                           views[v].cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ())
                              .z() > 0.0;
    if (in_front && in_picture(views[s], point)) {
      worth += kStandInWorth * worth_of_point(views[v], views[s], point, options);
    }
  }
  return worth;
}

/// Takes the best source again and again; those on the side of one already taken count less.
std::vector<std::size_t> choose_sources(std::span<const DenseView> views,
                                        std::size_t v,
                                        std::vector<double> worth,
                                        std::size_t count) {
  std::vector<std::size_t> chosen;
  const Eigen::Vector3d center = camera_center(views[v].cam_from_world);
  const auto direction = [&](std::size_t s) {
    return Eigen::Vector3d((camera_center(views[s].cam_from_world) - center).normalized());
  };
  const double negligible = 0.01 * *std::ranges::max_element(worth);
  while (chosen.size() < count) {
    const auto best = static_cast<std::size_t>(std::ranges::max_element(worth) - worth.begin());
    if (!(worth[best] > negligible)) {
      break;
    }
    chosen.push_back(best);
    worth[best] = 0.0;
    for (std::size_t s = 0; s < worth.size(); ++s) {
      if (worth[s] > 0.0 && direction(s).dot(direction(best)) > kSameSideCosine) {
        worth[s] *= kSameSideWorth;
      }
    }
  }
  return chosen;
}

void set_depth_range(const Scene& scene,
                     const DenseView& view,
                     StereoPlan& plan,
                     const ViewPoints& points) {
  std::vector<double> depths = depths_of(view, points.seen);
  if (depths.size() < kFewPoints) {
    const std::vector<double> more = depths_of(view, landmarks_in_front(scene, view));
    depths.insert(depths.end(), more.begin(), more.end());
  }
  if (depths.empty()) {
    return;
  }
  constexpr double kNearMargin = 0.6;
  constexpr double kFarMargin = 1.6;
  plan.min_depth = static_cast<float>(kNearMargin * percentile(depths, 0.01));
  plan.max_depth = static_cast<float>(kFarMargin * percentile(depths, 0.99));
}

}  // namespace

Result<> ViewSelectionOptions::validate() const {
  if (max_sources < 1 || max_sources > kMaxStereoSources) {
    return fail(ErrorCode::kInvalidArgument,
                "max_sources is {}, not in [1, {}]",
                max_sources,
                kMaxStereoSources);
  }
  if (max_neighbors < max_sources || max_neighbors > 32) {
    return fail(ErrorCode::kInvalidArgument,
                "max_neighbors is {}, not in [{}, 32]",
                max_neighbors,
                max_sources);
  }
  const auto check = [](const char* name, double value) -> Result<> {
    if (!(value > 0.0 && value <= 60.0)) {
      return fail(ErrorCode::kInvalidArgument, "{} is {}, not in (0, 60]", name, value);
    }
    return {};
  };
  TM_RETURN_IF_ERROR(check("best_angle_deg", best_angle_deg));
  TM_RETURN_IF_ERROR(check("narrow_sigma_deg", narrow_sigma_deg));
  return check("wide_sigma_deg", wide_sigma_deg);
}

Result<std::vector<StereoPlan>> plan_stereo(const Scene& scene,
                                            std::span<const DenseView> views,
                                            const ViewSelectionOptions& options) {
  TM_RETURN_IF_ERROR(options.validate());
  std::vector<ViewPoints> points;
  for (const DenseView& view : views) {
    TM_CHECK(index(view.source) < scene.views.size());
    points.push_back(points_of(scene, view));
  }
  std::vector<StereoPlan> plans(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    std::vector<double> worth(views.size(), 0.0);
    for (std::size_t s = 0; s < views.size(); ++s) {
      worth[s] = s == v ? 0.0 : worth_of_source(views, points, v, s, options);
    }
    plans[v].neighbors = choose_sources(views, v, std::move(worth), options.max_neighbors);
    const std::size_t sources = std::min(options.max_sources, plans[v].neighbors.size());
    plans[v].sources.assign(plans[v].neighbors.begin(),
                            plans[v].neighbors.begin() + static_cast<std::ptrdiff_t>(sources));
    set_depth_range(scene, views[v], plans[v], points[v]);
    for (const Eigen::Vector3d& point : points[v].seen) {
      plans[v].seeds_in_cam.emplace_back((views[v].cam_from_world * point).cast<float>());
    }
  }
  return plans;
}

}  // namespace trigmesh
