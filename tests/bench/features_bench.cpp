// Extraction of SIFT features from a rendered photograph-sized picture, one thread.

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "sfm/features/features.hpp"

namespace {

/// Blurred noise over several octaves: about as rich in blobs as a photograph of masonry.
cv::Mat texture(int width_px, int height_px) {
  cv::Mat sum(height_px, width_px, CV_32F, cv::Scalar(0));
  cv::RNG random(7);
  for (const double sigma : {1.5, 3.0, 6.0, 12.0}) {
    cv::Mat noise(height_px, width_px, CV_32F);
    random.fill(noise, cv::RNG::NORMAL, 0.0, 60.0 * sigma);
    cv::GaussianBlur(noise, noise, cv::Size(), sigma);
    sum += noise;
  }
  cv::Mat grey;
  sum.convertTo(grey, CV_8U, 1.0, 128.0);
  return grey;
}

void extract_sift(benchmark::State& state) {
  const cv::Mat grey = texture(1536, 1024);
  trigmesh::FeatureOptions options;
  options.upsample = state.range(0) != 0;
  const auto extractor = trigmesh::create_feature_extractor(trigmesh::FeatureKind::kSift, options);
  std::size_t count = 0;
  for (auto _ : state) {
    const auto features = (*extractor)->extract(grey);
    count = features->size();
    benchmark::DoNotOptimize(count);
  }
  state.counters["keypoints"] = static_cast<double>(count);
}

BENCHMARK(extract_sift)->ArgName("upsample")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
