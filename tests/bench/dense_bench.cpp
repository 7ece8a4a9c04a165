// Cost of the PatchMatch kernel (one patch of 32 samples in one source) and of a whole small depth
// map, per pixel.
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core/mat.hpp>

#include "sfm/dense/patch_match.hpp"
#include "sfm/dense/patch_match_kernel.hpp"
#include "sfm/dense/reference_patch.hpp"

namespace trigmesh {
namespace {

cv::Mat picture(int width, int height, double shift_px) {
  cv::Mat grey(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = x + shift_px;
      const double value = 128.0 + 50.0 * std::sin(0.31 * u + 0.13 * y) * std::cos(0.23 * y) +
                           40.0 * std::sin(0.071 * u * std::cos(0.05 * y));
      grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(value);
    }
  }
  return grey;
}

using CostFunction = void (*)(const ReferencePatch&,
                              std::span<const SourceProjection>,
                              std::span<const PlaneHypothesis>,
                              std::span<float>);

void run_kernel(benchmark::State& state, CostFunction costs_of) {
  const cv::Mat grey = picture(640, 480, 0.0);
  std::vector<std::uint32_t> quads(640 * 480, 0x40302010U);
  ReferencePatch patch;
  ReferencePatchMaker(grey, 12.0F).make(320, 240, patch);
  const SourceProjection source{.quads = quads.data(),
                                .stride = 640,
                                .max_x_px = 639.0F,
                                .max_y_px = 479.0F,
                                .base = {300.0F, 250.0F, 1.0F},
                                .column_x = {1.0F, 0.1F, 0.001F},
                                .column_y = {-0.1F, 0.9F, 0.0F},
                                .epipole = {20.0F, 5.0F, 0.1F}};
  const std::vector<SourceProjection> sources(5, source);
  const std::vector<PlaneHypothesis> hypotheses(8, {0.4F, 0.001F, -0.001F});
  std::vector<float> costs(40);
  for (auto _ : state) {
    costs_of(patch, sources, hypotheses, costs);
    benchmark::DoNotOptimize(costs.data());
  }
  state.SetItemsProcessed(state.iterations() * 40);
}

void match_costs_simd(benchmark::State& state) {
  run_kernel(state, match_costs);
}

void match_costs_plain(benchmark::State& state) {
  run_kernel(state, match_costs_reference);
}

void depth_map_160x120(benchmark::State& state) {
  const Camera camera{.model = CameraModel::kPinhole,
                      .width_px = 160,
                      .height_px = 120,
                      .fx_px = 150.0,
                      .fy_px = 150.0,
                      .cx_px = 79.5,
                      .cy_px = 59.5,
                      .distortion = {}};
  StereoProblem problem;
  problem.reference = {picture(160, 120, 0.0), {}, camera, {}};
  problem.min_depth = 1.0F;
  problem.max_depth = 6.0F;
  for (const double baseline : {0.1, -0.1, 0.2, -0.2, 0.3}) {
    // A wall at depth 2: a shift of 75 px a unit of baseline.
    StereoImage source{picture(160, 120, 75.0 * baseline), {}, camera, {}};
    source.cam_from_world.translation.x() = -baseline;
    problem.sources.push_back(source);
  }
  SerialExecutor executor;
  for (auto _ : state) {
    benchmark::DoNotOptimize(estimate_depth_map(problem, {}, executor));
  }
  state.SetItemsProcessed(state.iterations() * 160 * 120);
}

BENCHMARK(match_costs_simd);
BENCHMARK(match_costs_plain);
BENCHMARK(depth_map_160x120)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trigmesh
