#include "sfm/texture/chart_merging.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core/types.hpp>

#include "tests/support/random.hpp"

namespace trigmesh {
namespace {

Chart chart(std::uint32_t view, std::uint32_t face, const cv::Rect& rectangle) {
  Chart result;
  result.view = view;
  result.faces = {face};
  result.source_x = rectangle.x;
  result.source_y = rectangle.y;
  result.width = rectangle.width;
  result.height = rectangle.height;
  return result;
}

cv::Rect rectangle_of(const Chart& chart) {
  return {chart.source_x, chart.source_y, chart.width, chart.height};
}

TEST(MergeCloseCharts, JoinsWhatLiesInsideOrBeside) {
  const auto merged = merge_close_charts({chart(3, 0, {10, 10, 5, 5}),
                                          chart(3, 1, {0, 0, 100, 50}),
                                          chart(3, 2, {103, 0, 20, 50}),
                                          chart(3, 3, {300, 300, 5, 5})},
                                         4);
  ASSERT_EQ(merged.size(), 2U);
  EXPECT_EQ(merged[0].faces, (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(rectangle_of(merged[0]), cv::Rect(0, 0, 123, 50));
  EXPECT_EQ(merged[1].faces, (std::vector<std::uint32_t>{3}));
}

TEST(MergeCloseCharts, NeverAcrossViews) {
  const auto merged =
      merge_close_charts({chart(0, 0, {10, 10, 5, 5}), chart(1, 1, {10, 10, 5, 5})}, 4);
  EXPECT_EQ(merged.size(), 2U);
}

TEST(MergeCloseCharts, KeepsEveryFaceAndNeverNeedsMoreTexels) {
  constexpr int kPadding = 3;
  test_support::Random random(5);
  std::vector<Chart> charts;
  std::int64_t before = 0;
  for (std::uint32_t f = 0; f < 400; ++f) {
    const auto below = [&random](std::size_t count) {
      return static_cast<int>(random.below(count));
    };
    const cv::Rect rectangle(below(500), below(500), 1 + below(40), 1 + below(40));
    charts.push_back(chart(f % 2, f, rectangle));
    before += (rectangle.width + 2 * kPadding) * (rectangle.height + 2 * kPadding);
  }
  const auto merged = merge_close_charts(charts, kPadding);
  EXPECT_LT(merged.size(), charts.size() - 50);
  std::int64_t after = 0;
  std::vector<int> found(charts.size(), 0);
  for (const Chart& one : merged) {
    after += (one.width + 2 * kPadding) * (one.height + 2 * kPadding);
    for (const std::uint32_t face : one.faces) {
      ++found[face];
      EXPECT_EQ(charts[face].view, one.view);
      const cv::Rect inner = rectangle_of(charts[face]);
      EXPECT_EQ(inner & rectangle_of(one), inner);
    }
  }
  EXPECT_LE(after, before);
  EXPECT_EQ(found, std::vector<int>(charts.size(), 1));
}

}  // namespace
}  // namespace trigmesh
