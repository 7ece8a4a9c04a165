#include <cstdint>
#include <random>

#include <benchmark/benchmark.h>
#include <hwy/targets.h>

#include "sfm/matching/descriptor_matcher.hpp"

namespace trigmesh {
namespace {

FeatureSet random_features(FeatureKind kind, std::size_t bytes, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  FeatureSet set;
  set.kind = kind;
  set.descriptor_bytes = bytes;
  set.keypoints.resize(count);
  set.descriptors.resize(count * bytes);
  const bool dot = descriptor_metric(kind) == DescriptorMetric::kDotProduct;
  for (auto& byte : set.descriptors) {
    // Mean square of the dot-product bytes gives a length of 256 for 128 of them.
    byte = static_cast<std::uint8_t>(dot ? random() % 40 : random() % 256);
  }
  return set;
}

/// 8000 x 8000 with one instruction set (argument: its bit in Highway's list).
void match_8000(benchmark::State& state, FeatureKind kind, std::size_t bytes, std::int64_t target) {
  hwy::SetSupportedTargetsForTest(0);
  if ((hwy::SupportedTargets() & target) == 0) {
    state.SkipWithError("this machine does not have the instruction set");
    return;
  }
  hwy::SetSupportedTargetsForTest(target);
  hwy::GetChosenTarget().Update(target);
  const FeatureSet a = random_features(kind, bytes, 8000, 1);
  const FeatureSet b = random_features(kind, bytes, 8000, 2);
  const auto index_a = DescriptorIndex::build(a);
  const auto index_b = DescriptorIndex::build(b);
  for (auto _ : state) {
    benchmark::DoNotOptimize(match_descriptors(*index_a, *index_b, {}));
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

BENCHMARK_CAPTURE(match_8000, sift128_avx512vnni, FeatureKind::kSift, 128, HWY_AVX3_DL)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_8000, sift128_avx512, FeatureKind::kSift, 128, HWY_AVX3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_8000, sift128_avx2, FeatureKind::kSift, 128, HWY_AVX2)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_8000, sift128_sse4, FeatureKind::kSift, 128, HWY_SSE4)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_8000, surf64_avx2, FeatureKind::kSurf, 64, HWY_AVX2)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_8000, orb32_avx512, FeatureKind::kOrb, 32, HWY_AVX3_DL)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_8000, orb32_avx2, FeatureKind::kOrb, 32, HWY_AVX2)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match_8000, akaze64_avx2, FeatureKind::kAkaze, 64, HWY_AVX2)
    ->Unit(benchmark::kMillisecond);

void build_index_8000(benchmark::State& state) {
  const FeatureSet features = random_features(FeatureKind::kSift, 128, 8000, 1);
  for (auto _ : state) {
    benchmark::DoNotOptimize(DescriptorIndex::build(features));
  }
}

BENCHMARK(build_index_8000)->Unit(benchmark::kMillisecond);

void match_preemptive(benchmark::State& state) {
  const FeatureSet a = random_features(FeatureKind::kSift, 128, 8000, 1);
  const FeatureSet b = random_features(FeatureKind::kSift, 128, 8000, 2);
  const auto index_a = DescriptorIndex::build(a);
  const auto index_b = DescriptorIndex::build(b);
  for (auto _ : state) {
    benchmark::DoNotOptimize(match_descriptors(
        *index_a, *index_b, {.max_features = static_cast<std::size_t>(state.range(0))}));
  }
}

BENCHMARK(match_preemptive)->Arg(300)->Arg(500)->Arg(1000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace trigmesh
