#include <cstddef>
#include <cstdint>

#include <benchmark/benchmark.h>

#include "sfm/mapping/bundle_adjustment.hpp"
#include "tests/support/synthetic_scene.hpp"

namespace trigmesh {
namespace {

using test_support::CloudKind;

/// About five observations a point, half a pixel of noise, poses off by a milliradian and a
/// thousandth of the distance.
Scene noisy_scene(std::size_t views, std::size_t points, CameraModel model) {
  test_support::SyntheticSceneOptions options;
  options.cloud = CloudKind::kVolume;
  options.views = views;
  options.points = points;
  options.noise_px = 0.5;
  options.dropout_ratio = 1.0 - 5.0 / static_cast<double>(views);
  options.min_pair_matches = points;  // no pair lists wanted
  options.camera.model = model;
  if (model != CameraModel::kPinhole) {
    options.camera.distortion = {-0.05, 0.01, 0.0, 0.0};
  }
  const auto scene = test_support::make_synthetic_scene(options);
  return test_support::perturbed(scene.truth,
                                 {.rotation_rad = 1e-3, .translation = 5e-3, .point = 1e-2});
}

void run(benchmark::State& state,
         const Scene& start,
         const BundleSelection& selection,
         const BundleOptions& options) {
  BundleReport report;
  for (auto _ : state) {
    state.PauseTiming();
    Scene scene = start;
    state.ResumeTiming();
    report = adjust_bundle(scene, selection, options);
  }
  state.counters["observations"] = static_cast<double>(report.observations);
  state.counters["iterations"] = report.iterations;
  state.counters["rmse_px"] = report.final_rmse_px;
}

void global_pinhole(benchmark::State& state, BundleSolver solver) {
  const Scene scene = noisy_scene(static_cast<std::size_t>(state.range(0)),
                                  static_cast<std::size_t>(state.range(1)),
                                  CameraModel::kPinhole);
  BundleOptions options;
  options.solver = solver;
  run(state, scene, select_everything(scene), options);
}

void global_brown_conrady(benchmark::State& state) {
  const Scene scene = noisy_scene(25, 8000, CameraModel::kBrownConrady);
  run(state, scene, select_everything(scene), {});
}

void global_free_intrinsics(benchmark::State& state) {
  const Scene scene = noisy_scene(25, 8000, CameraModel::kRadial);
  BundleOptions options;
  options.intrinsics = {{.focal = true, .distortion = 2, .prior = {}}};
  run(state, scene, select_everything(scene), options);
}

void local_six_views(benchmark::State& state) {
  const Scene scene = noisy_scene(25, 8000, CameraModel::kPinhole);
  std::vector<ViewId> views;
  for (std::size_t i = 0; i < 6; ++i) {
    views.push_back(id_of<ViewId>(10 + i));
  }
  run(state, scene, select_around(scene, views), {});
}

void one_pose(benchmark::State& state) {
  const Scene scene = noisy_scene(25, 8000, CameraModel::kPinhole);
  BundleSelection selection = select_everything(scene);
  selection.variable_views = {ViewId{12}};
  selection.landmark_mode = LandmarkMode::kConstant;
  run(state, scene, selection, {});
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Args({10, 3000})->Args({25, 8000})->Args({100, 20000})->Args({200, 30000});
}

BENCHMARK_CAPTURE(global_pinhole, schur, BundleSolver::kSchur)
    ->Apply(sizes)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(global_pinhole, ceres, BundleSolver::kCeres)
    ->Apply(sizes)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(global_brown_conrady)->Unit(benchmark::kMillisecond);
BENCHMARK(global_free_intrinsics)->Unit(benchmark::kMillisecond);
BENCHMARK(local_six_views)->Unit(benchmark::kMillisecond);
BENCHMARK(one_pose)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trigmesh
