#include <cstdint>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "sfm/matching/guided_matcher.hpp"
#include "sfm/matching/two_view_verification.hpp"
#include "tests/unit/sfm/matching/synthetic_pair.hpp"

namespace trigmesh {
namespace {

using test_support::make_pair;
using test_support::SyntheticPair;

/// 1000 matches; argument: how many per cent of them are true.
void verify_1000(benchmark::State& state) {
  const auto true_count = static_cast<std::size_t>(10 * state.range(0));
  const SyntheticPair pair =
      make_pair({.true_count = true_count, .outlier_count = 1000 - true_count});
  std::size_t inliers = 0;
  for (auto _ : state) {
    inliers = pair.verify().inliers.size();
  }
  state.counters["inliers"] = static_cast<double>(inliers);
}

BENCHMARK(verify_1000)->Arg(90)->Arg(75)->Arg(60)->Arg(45)->Unit(benchmark::kMillisecond);

void verify_plane_1000(benchmark::State& state) {
  const SyntheticPair pair =
      make_pair({.true_count = 800, .outlier_count = 200, .depth_variation = 0.0});
  for (auto _ : state) {
    benchmark::DoNotOptimize(pair.verify_uncalibrated());
  }
}

BENCHMARK(verify_plane_1000)->Unit(benchmark::kMillisecond);

/// As many features as the argument in each image, half of them seen in both.
void match_guided(benchmark::State& state) {
  const auto count = static_cast<std::size_t>(state.range(0));
  const SyntheticPair pair =
      make_pair({.true_count = count / 2, .outlier_count = count - count / 2});
  std::mt19937 random(1);
  FeatureSet sets[2];
  for (FeatureSet& set : sets) {
    set.descriptor_bytes = 128;
    set.keypoints.resize(count);
    set.descriptors.resize(128 * count);
    for (auto& byte : set.descriptors) {
      byte = static_cast<std::uint8_t>(random() % 40);
    }
  }
  const auto first = DescriptorIndex::build(sets[0]);
  const auto second = DescriptorIndex::build(sets[1]);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        trigmesh::match_guided({*first, pair.first}, {*second, pair.second}, pair.fundamental, {}));
  }
}

BENCHMARK(match_guided)->Arg(2000)->Arg(5000)->Arg(8000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trigmesh
