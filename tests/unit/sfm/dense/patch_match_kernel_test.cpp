#include "sfm/dense/patch_match_kernel.hpp"

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "sfm/dense/reference_patch.hpp"

namespace trigmesh {
namespace {

constexpr int kWidth = 37;
constexpr int kHeight = 29;

/// A random picture as quads, a random patch and projections near the identity.
struct KernelInput {
  std::vector<std::uint32_t> quads;
  ReferencePatch patch;
  std::vector<SourceProjection> sources;
  std::vector<PlaneHypothesis> hypotheses;
};

KernelInput random_input(unsigned seed) {
  std::mt19937 generator(seed);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(generator() % 65536) / 65535.0F;
  };
  cv::Mat grey(kHeight, kWidth, CV_8UC1);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(generator() % 256);
    }
  }
  KernelInput input;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto at = [&](int column, int row) {
        return std::uint32_t{
            grey.at<std::uint8_t>(std::min(row, kHeight - 1), std::min(column, kWidth - 1))};
      };
      input.quads.push_back(at(x, y) | at(x + 1, y) << 8U | at(x, y + 1) << 16U |
                            at(x + 1, y + 1) << 24U);
    }
  }
  ReferencePatchMaker(grey, 40.0F).make(15, 14, input.patch);
  for (int s = 0; s < 5; ++s) {
    SourceProjection source;
    source.quads = input.quads.data();
    source.stride = kWidth;
    source.max_x_px = kWidth - 1;
    source.max_y_px = kHeight - 1;
    source.base = {15.0F + uniform(-6.0F, 6.0F), 14.0F + uniform(-6.0F, 6.0F), 1.0F};
    source.column_x = {uniform(0.8F, 1.2F), uniform(-0.2F, 0.2F), uniform(-0.01F, 0.01F)};
    source.column_y = {uniform(-0.2F, 0.2F), uniform(0.8F, 1.2F), uniform(-0.01F, 0.01F)};
    source.epipole = {uniform(-40.0F, 40.0F), uniform(-40.0F, 40.0F), uniform(-0.5F, 0.5F)};
    input.sources.push_back(source);
  }
  for (int h = 0; h < 7; ++h) {
    input.hypotheses.push_back(
        {uniform(0.1F, 0.6F), uniform(-0.005F, 0.005F), uniform(-0.005F, 0.005F)});
  }
  return input;
}

TEST(PatchMatchKernel, AgreesWithPlainLoopsOnEveryInstructionSet) {
  for (const auto target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    for (unsigned seed = 0; seed < 20; ++seed) {
      const KernelInput input = random_input(seed);
      std::vector<float> costs(input.sources.size() * input.hypotheses.size());
      std::vector<float> expected(costs.size());
      match_costs(input.patch, input.sources, input.hypotheses, costs);
      match_costs_reference(input.patch, input.sources, input.hypotheses, expected);
      EXPECT_THAT(costs, testing::Pointwise(testing::FloatNear(2e-3F), expected))
          << hwy::TargetName(target) << " seed " << seed;
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(PatchMatchKernel, PerfectMatchCostsAlmostNothing) {
  KernelInput input = random_input(3);
  SourceProjection same = input.sources[0];
  same.base = {15.0F, 14.0F, 1.0F};
  same.column_x = {1.0F, 0.0F, 0.0F};
  same.column_y = {0.0F, 1.0F, 0.0F};
  same.epipole = {0.0F, 0.0F, 0.0F};
  std::vector<float> costs(1);
  match_costs(input.patch, std::span(&same, 1), std::span(input.hypotheses).first(1), costs);
  EXPECT_LT(costs[0], 0.01F);
}

TEST(PatchMatchKernel, RefusesPlanesBehindOrOutsideOfTheSource) {
  KernelInput input = random_input(4);
  SourceProjection behind = input.sources[0];
  behind.base = {15.0F, 14.0F, -1.0F};
  behind.epipole = {0.0F, 0.0F, 0.0F};
  SourceProjection outside = input.sources[0];
  outside.base = {-1.0F, 14.0F, 1.0F};
  outside.epipole = {0.0F, 0.0F, 0.0F};
  const std::vector<SourceProjection> sources{behind, outside};
  std::vector<float> costs(2);
  match_costs(input.patch, sources, std::span(input.hypotheses).first(1), costs);
  EXPECT_THAT(costs, testing::Each(kNoMatchCost));
}

TEST(ReferencePatchMaker, StaysOnAThinBar) {
  cv::Mat grey(21, 21, CV_8UC1, cv::Scalar(20));
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 9; x <= 11; ++x) {
      grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(200 + 4 * (y % 3));
    }
  }
  ReferencePatch patch;
  ReferencePatchMaker(grey, 12.0F).make(10, 10, patch);
  float on_bar = 0.0F;
  for (std::size_t i = 0; i < kPatchSampleCount; ++i) {
    on_bar += std::abs(patch.offset_x_px[i]) <= 1.0F ? patch.weight[i] : 0.0F;
  }
  EXPECT_GT(on_bar, 0.99F);
}

TEST(ReferencePatchMaker, EnlargesPatchesOfPlainSurfaces) {
  const cv::Mat plain(40, 40, CV_8UC1, cv::Scalar(100));
  ReferencePatch patch;
  EXPECT_EQ(ReferencePatchMaker(plain, 12.0F).make(20, 20, patch), 3);
  cv::Mat busy = plain.clone();
  for (int y = 0; y < busy.rows; ++y) {
    for (int x = 0; x < busy.cols; ++x) {
      busy.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>((x * 37 + y * 91) % 30 + 90);
    }
  }
  EXPECT_EQ(ReferencePatchMaker(busy, 12.0F).make(20, 20, patch), 1);
}

}  // namespace
}  // namespace trigmesh
