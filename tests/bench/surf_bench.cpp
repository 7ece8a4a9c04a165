// Cost of the steps of SURF, and of AKAZE and ORB beside it, on a synthetic 1536x1024 picture with
// texture at all scales.
#include <algorithm>
#include <cstdint>
#include <random>

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

#include "sfm/features/features.hpp"
#include "sfm/features/integral_image.hpp"
#include "sfm/features/surf_descriptor.hpp"
#include "sfm/features/surf_detector.hpp"

namespace trigmesh {
namespace {

/// Noise of octaves 1/2, 1/4 ... 1/64 of the Nyquist frequency, about equally strong: like foliage
/// and stone.
cv::Mat picture() {
  std::mt19937 generator(1);
  cv::Mat sum(1024, 1536, CV_32FC1, cv::Scalar(128.0));
  for (int cell = 4; cell <= 128; cell *= 2) {
    cv::Mat coarse(1024 / cell, 1536 / cell, CV_32FC1);
    for (int y = 0; y < coarse.rows; ++y) {
      for (int x = 0; x < coarse.cols; ++x) {
        coarse.at<float>(y, x) = static_cast<float>(generator() % 61) - 30.0F;
      }
    }
    cv::Mat fine;
    cv::resize(coarse, fine, sum.size(), 0.0, 0.0, cv::INTER_CUBIC);
    sum += fine;
  }
  cv::Mat grey;
  sum.convertTo(grey, CV_8U);
  return grey;
}

void run_extractor(benchmark::State& state, FeatureKind kind, const FeatureOptions& options) {
  const cv::Mat grey = picture();
  const auto extractor = create_feature_extractor(kind, options);
  std::size_t found = 0;
  for (auto _ : state) {
    const auto set = (*extractor)->extract(grey);
    found = set->size();
    benchmark::DoNotOptimize(set->descriptors.data());
  }
  state.counters["keypoints"] = static_cast<double>(found);
}

void surf_integral_image(benchmark::State& state) {
  const cv::Mat grey = picture();
  for (auto _ : state) {
    benchmark::DoNotOptimize(IntegralImage(grey).row(0));
  }
}

void surf_detection(benchmark::State& state) {
  const IntegralImage integral(picture());
  std::size_t found = 0;
  for (auto _ : state) {
    found = detect_surf_keypoints(integral, {.threshold = 4e-5F, .octaves = 4}).size();
  }
  state.counters["keypoints"] = static_cast<double>(found);
}

/// Keypoints such as photographs have: small ones are by far the most frequent.
std::vector<Keypoint> typical_keypoints() {
  std::mt19937 generator(2);
  const auto uniform = [&] { return static_cast<float>(generator() % 10000) * 1e-4F; };
  std::vector<Keypoint> keypoints;
  for (int i = 0; i < 1000; ++i) {
    const float u = uniform();
    keypoints.push_back({.x_px = 100.0F + 1300.0F * uniform(),
                         .y_px = 100.0F + 800.0F * uniform(),
                         .scale_px = std::min(8.0F, 1.6F / (1.0F - 0.9F * u)),
                         .angle_rad = 6.0F * uniform() - 3.0F});
  }
  return keypoints;
}

void surf_orientations_of_1000(benchmark::State& state) {
  const IntegralImage integral(picture());
  const auto keypoints = typical_keypoints();
  for (auto _ : state) {
    for (const Keypoint& keypoint : keypoints) {
      benchmark::DoNotOptimize(surf_orientation(integral, keypoint));
    }
  }
}

void surf_descriptors_of_1000(benchmark::State& state, bool oriented) {
  const IntegralImage integral(picture());
  auto keypoints = typical_keypoints();
  if (!oriented) {
    std::for_each(keypoints.begin(), keypoints.end(), [](Keypoint& k) { k.angle_rad = 0.0F; });
  }
  for (auto _ : state) {
    for (const Keypoint& keypoint : keypoints) {
      benchmark::DoNotOptimize(surf_descriptor(integral, keypoint));
    }
  }
}

BENCHMARK(surf_integral_image)->Unit(benchmark::kMillisecond);
BENCHMARK(surf_detection)->Unit(benchmark::kMillisecond);
BENCHMARK(surf_orientations_of_1000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(surf_descriptors_of_1000, upright, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(surf_descriptors_of_1000, oriented, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_extractor,
                  surf_upright,
                  FeatureKind::kSurf,
                  FeatureOptions{.oriented = false})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_extractor, surf_oriented, FeatureKind::kSurf, FeatureOptions{})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_extractor, akaze, FeatureKind::kAkaze, FeatureOptions{})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run_extractor, orb, FeatureKind::kOrb, FeatureOptions{})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trigmesh
