// Time and, as counters, accuracy of the solvers on synthetic problems of known truth; OpenCV's
// counterparts beside them.
#include <array>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <benchmark/benchmark.h>
#include <opencv2/calib3d.hpp>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/absolute_pose.hpp"
#include "sfm/geometry/five_point.hpp"
#include "sfm/geometry/p3p.hpp"
#include "sfm/geometry/relative_pose.hpp"
#include "sfm/geometry/triangulation.hpp"
#include "tests/unit/sfm/geometry/two_view.hpp"

namespace trigmesh {
namespace {

using synthetic::Random;

constexpr double kDegree = std::numbers::pi / 180.0;

Camera camera_of(std::int64_t model) {
  switch (model) {
    case 0:
      return synthetic::pinhole();
    case 1:
      return synthetic::brown_conrady();
    default:
      return synthetic::fisheye();
  }
}

void normalize_pixels(benchmark::State& state) {
  const Camera camera = camera_of(state.range(0));
  Random random(1);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < 1000; ++i) {
    pixels.push_back(Eigen::Vector2d(camera.cx_px, camera.cy_px) + random.gauss2(150.0));
  }
  for (auto _ : state) {
    for (const auto& pixel : pixels) {
      benchmark::DoNotOptimize(normalize_pixel(camera, pixel));
    }
  }
  state.SetItemsProcessed(state.iterations() * 1000);
}

BENCHMARK(normalize_pixels)->ArgName("model")->DenseRange(0, 2);

void project_points_with_derivatives(benchmark::State& state) {
  const Camera camera = camera_of(state.range(0));
  Random random(1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 1000; ++i) {
    points.push_back(Eigen::Vector3d(0.0, 0.0, 5.0) + random.in_box(1.0));
  }
  for (auto _ : state) {
    for (const auto& point : points) {
      benchmark::DoNotOptimize(project_with_derivatives(camera, point));
    }
  }
  state.SetItemsProcessed(state.iterations() * 1000);
}

BENCHMARK(project_points_with_derivatives)->ArgName("model")->DenseRange(0, 2);

/// Tracks of `views` sightings with 0.5 px noise; every track has `wrong` sightings that are 100 px
/// off.
struct Tracks {
  Camera camera = synthetic::brown_conrady();
  std::vector<std::vector<Sighting>> sightings;

  Tracks(std::size_t views, std::size_t wrong) {
    Random random(2);
    const auto poses = synthetic::arc_of_cameras(views, 30.0 * kDegree);
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d point = random.in_box(1.0);
      std::vector<Sighting> track;
      for (std::size_t k = 0; k < views; ++k) {
        Eigen::Vector2d pixel = *project(camera, poses[k] * point) + random.gauss2(0.5);
        pixel += k < wrong ? Eigen::Vector2d(0.0, 100.0) : Eigen::Vector2d::Zero();
        track.push_back(*make_sighting(camera, poses[k], pixel));
      }
      sightings.push_back(track);
    }
  }
};

void triangulate_tracks(benchmark::State& state) {
  const Tracks tracks(static_cast<std::size_t>(state.range(0)), 0);
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(triangulate(tracks.sightings[next++ % 200], {}));
  }
}

BENCHMARK(triangulate_tracks)->ArgName("views")->Arg(2)->Arg(3)->Arg(5)->Arg(10)->Arg(15);

void triangulate_tracks_with_wrong_views(benchmark::State& state) {
  const Tracks tracks(static_cast<std::size_t>(state.range(0)),
                      static_cast<std::size_t>(state.range(1)));
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(triangulate_robust(tracks.sightings[next++ % 200], {}));
  }
}

BENCHMARK(triangulate_tracks_with_wrong_views)
    ->ArgNames({"views", "wrong"})
    ->Args({3, 0})
    ->Args({3, 1})
    ->Args({5, 1})
    ->Args({10, 0})
    ->Args({10, 3});

void p3p(benchmark::State& state) {
  Random random(3);
  const Rigid3 truth{random.rotation(), {0.0, 0.0, 5.0}};
  std::vector<std::array<Eigen::Vector3d, 3>> rays;
  std::vector<std::array<Eigen::Vector3d, 3>> points;
  for (int i = 0; i < 100; ++i) {
    points.push_back({random.in_box(1.0), random.in_box(1.0), random.in_box(1.0)});
    const auto& p = points.back();
    rays.push_back(
        {(truth * p[0]).normalized(), (truth * p[1]).normalized(), (truth * p[2]).normalized()});
  }
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(solve_p3p(rays[next % 100], points[next % 100]));
    ++next;
  }
}

BENCHMARK(p3p);

void five_point(benchmark::State& state) {
  Random random(4);
  std::vector<std::array<Eigen::Vector3d, 5>> first(100);
  std::vector<std::array<Eigen::Vector3d, 5>> second(100);
  for (std::size_t i = 0; i < 100; ++i) {
    const auto m = synthetic::make_two_view(random, {.count = 5});
    for (std::size_t k = 0; k < 5; ++k) {
      first[i].at(k) = m.first[k].homogeneous();
      second[i].at(k) = m.second[k].homogeneous();
    }
  }
  std::size_t next = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(solve_five_point(first[next % 100], second[next % 100]));
    ++next;
  }
}

BENCHMARK(five_point);

struct PoseProblem {
  Camera camera = synthetic::pinhole();
  Rigid3 truth;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<Eigen::Vector3d> points;

  PoseProblem(Random& random, std::size_t count, double outlier_ratio)
      : truth{random.rotation(), random.in_box(3.0)} {
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d pixel(random.uniform(0.0, camera.width_px),
                                  random.uniform(0.0, camera.height_px));
      const Eigen::Vector3d ray = normalize_pixel(camera, pixel)->homogeneous();
      points.push_back(truth.inverse() * (random.uniform(3.0, 9.0) * ray));
      const bool wrong = static_cast<double>(i) < outlier_ratio * static_cast<double>(count);
      pixels.push_back(wrong ? Eigen::Vector2d(random.uniform(0.0, camera.width_px),
                                               random.uniform(0.0, camera.height_px))
                             : Eigen::Vector2d(pixel + random.gauss2(0.7)));
    }
  }
};

std::vector<PoseProblem> pose_problems(const benchmark::State& state) {
  Random random(5);
  std::vector<PoseProblem> problems;
  for (int i = 0; i < 10; ++i) {
    problems.emplace_back(random,
                          static_cast<std::size_t>(state.range(0)),
                          static_cast<double>(state.range(1)) / 100.0);
  }
  return problems;
}

void report_error(benchmark::State& state, const std::vector<double>& errors_rad) {
  state.counters["rot_err_mdeg"] = 1e3 * synthetic::median(errors_rad) / kDegree;
}

void absolute_pose(benchmark::State& state) {
  const auto problems = pose_problems(state);
  std::vector<double> errors;
  std::size_t next = 0;
  for (auto _ : state) {
    const PoseProblem& p = problems[next++ % problems.size()];
    const AbsolutePose pose =
        estimate_absolute_pose(p.camera, p.pixels, p.points, {.max_error_px = 3.0});
    errors.push_back(
        synthetic::rotation_distance_rad(pose.cam_from_world.rotation, p.truth.rotation));
  }
  report_error(state, errors);
}

BENCHMARK(absolute_pose)
    ->ArgNames({"points", "outliers_%"})
    ->Args({2000, 0})
    ->Args({2000, 60})
    ->Args({2000, 80})
    ->Args({1000, 90})
    ->Args({200, 30})
    ->Unit(benchmark::kMillisecond);

void absolute_pose_opencv(benchmark::State& state) {
  const auto problems = pose_problems(state);
  std::vector<double> errors;
  std::size_t next = 0;
  cv::UsacParams params;
  params.maxIterations = 20000;
  params.confidence = 0.9999;
  params.threshold = 3.0;
  params.sampler = cv::SAMPLING_UNIFORM;
  params.score = cv::SCORE_METHOD_MSAC;
  params.loMethod = cv::LOCAL_OPTIM_INNER_AND_ITER_LO;
  for (auto _ : state) {
    const PoseProblem& p = problems[next++ % problems.size()];
    std::vector<cv::Point2d> pixels;
    std::vector<cv::Point3d> points;
    for (std::size_t i = 0; i < p.pixels.size(); ++i) {
      pixels.emplace_back(p.pixels[i].x(), p.pixels[i].y());
      points.emplace_back(p.points[i].x(), p.points[i].y(), p.points[i].z());
    }
    cv::Mat k = (cv::Mat_<double>(3, 3) << p.camera.fx_px,
                 0.0,
                 p.camera.cx_px,
                 0.0,
                 p.camera.fy_px,
                 p.camera.cy_px,
                 0.0,
                 0.0,
                 1.0);
    cv::Mat turn;
    cv::Mat translation;
    cv::Mat mask;
    cv::solvePnPRansac(
        points, pixels, k, cv::Mat::zeros(4, 1, CV_64F), turn, translation, mask, params);
    const Eigen::Vector3d vector(turn.at<double>(0), turn.at<double>(1), turn.at<double>(2));
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(vector.norm(), vector.normalized()));
    errors.push_back(synthetic::rotation_distance_rad(rotation, p.truth.rotation));
  }
  report_error(state, errors);
}

BENCHMARK(absolute_pose_opencv)
    ->ArgNames({"points", "outliers_%"})
    ->Args({2000, 60})
    ->Args({1000, 90})
    ->Unit(benchmark::kMillisecond);

void focal_pose(benchmark::State& state) {
  const auto problems = pose_problems(state);
  std::vector<double> errors;
  std::vector<double> focal_errors;
  std::size_t next = 0;
  for (auto _ : state) {
    const PoseProblem& p = problems[next++ % problems.size()];
    const FocalPose found =
        estimate_focal_pose(p.camera, p.pixels, p.points, {.max_error_px = 3.0}, {});
    errors.push_back(
        synthetic::rotation_distance_rad(found.pose.cam_from_world.rotation, p.truth.rotation));
    focal_errors.push_back(std::abs(found.camera.fx_px / p.camera.fx_px - 1.0));
  }
  report_error(state, errors);
  state.counters["focal_err_%"] = 100.0 * synthetic::median(focal_errors);
}

BENCHMARK(focal_pose)
    ->ArgNames({"points", "outliers_%"})
    ->Args({500, 30})
    ->Args({500, 60})
    ->Unit(benchmark::kMillisecond);

std::vector<synthetic::TwoViewMatches> two_view_problems(const benchmark::State& state) {
  Random random(6);
  std::vector<synthetic::TwoViewMatches> problems;
  for (int i = 0; i < 10; ++i) {
    problems.push_back(
        synthetic::make_two_view(random,
                                 {.count = static_cast<std::size_t>(state.range(0)),
                                  .outlier_ratio = static_cast<double>(state.range(1)) / 100.0,
                                  .noise_px = 0.5}));
  }
  return problems;
}

void relative_pose(benchmark::State& state) {
  const auto problems = two_view_problems(state);
  std::vector<double> errors;
  std::size_t next = 0;
  for (auto _ : state) {
    const auto& m = problems[next++ % problems.size()];
    const RelativePose pose =
        estimate_relative_pose(m.camera, m.camera, m.first_px, m.second_px, {});
    errors.push_back(synthetic::rotation_distance_rad(pose.second_from_first.rotation,
                                                      m.second_from_first.rotation));
  }
  report_error(state, errors);
}

BENCHMARK(relative_pose)
    ->ArgNames({"matches", "outliers_%"})
    ->Args({2000, 30})
    ->Args({2000, 60})
    ->Args({2000, 70})
    ->Unit(benchmark::kMillisecond);

void relative_pose_opencv(benchmark::State& state) {
  const auto problems = two_view_problems(state);
  std::vector<double> errors;
  std::size_t next = 0;
  cv::UsacParams params;
  params.maxIterations = 20000;
  params.confidence = 0.9999;
  params.threshold = 1.5;
  params.score = cv::SCORE_METHOD_MSAC;
  params.sampler = cv::SAMPLING_UNIFORM;
  params.loMethod = cv::LOCAL_OPTIM_INNER_AND_ITER_LO;
  for (auto _ : state) {
    const auto& m = problems[next++ % problems.size()];
    std::vector<cv::Point2d> first;
    std::vector<cv::Point2d> second;
    for (std::size_t i = 0; i < m.first_px.size(); ++i) {
      first.emplace_back(m.first_px[i].x(), m.first_px[i].y());
      second.emplace_back(m.second_px[i].x(), m.second_px[i].y());
    }
    const cv::Mat k = (cv::Mat_<double>(3, 3) << m.camera.fx_px,
                       0.0,
                       m.camera.cx_px,
                       0.0,
                       m.camera.fy_px,
                       m.camera.cy_px,
                       0.0,
                       0.0,
                       1.0);
    const cv::Mat zero = cv::Mat::zeros(4, 1, CV_64F);
    cv::Mat mask;
    const cv::Mat e = cv::findEssentialMat(first, second, k, k, zero, zero, mask, params);
    cv::Mat r1;
    cv::Mat r2;
    cv::Mat t;
    cv::decomposeEssentialMat(e, r1, r2, t);
    double error = 10.0;
    for (const cv::Mat& r : {r1, r2}) {
      Eigen::Matrix3d rotation;
      for (int row = 0; row < 3; ++row) {
        for (int col = 0; col < 3; ++col) {
          rotation(row, col) = r.at<double>(row, col);
        }
      }
      error = std::min(error,
                       synthetic::rotation_distance_rad(Eigen::Quaterniond(rotation),
                                                        m.second_from_first.rotation));
    }
    errors.push_back(error);
  }
  report_error(state, errors);
}

BENCHMARK(relative_pose_opencv)
    ->ArgNames({"matches", "outliers_%"})
    ->Args({2000, 30})
    ->Args({2000, 60})
    ->Args({2000, 70})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trigmesh
