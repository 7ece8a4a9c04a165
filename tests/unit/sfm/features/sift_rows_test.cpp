#include "sfm/features/sift_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh::sift {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::IsEmpty;

constexpr int kMargin = 32;

/// A row with a margin before it and the slack behind it.
class Row {
 public:
  explicit Row(int width) : values_(static_cast<std::size_t>(kMargin + width + kRowSlack)) {}

  Row(int width, std::mt19937& random) : Row(width) {
    std::uniform_real_distribution<float> grey(0.0F, 255.0F);
    std::generate(values_.begin(), values_.end(), [&] { return grey(random); });
  }

  float* begin() { return values_.data() + kMargin; }

  [[nodiscard]] float at(int x) const { return values_[static_cast<std::size_t>(kMargin + x)]; }

 private:
  std::vector<float> values_;
};

float weight(const GaussianKernel& kernel, int offset) {
  return kernel.half[static_cast<std::size_t>(std::abs(offset))];
}

TEST(GaussianKernel, SumsToOneAndHasExactlyTheVarianceAskedFor) {
  for (const double sigma : {0.6, 1.2263, 1.52, 2.4525, 3.09, 4.0}) {
    const GaussianKernel kernel = make_gaussian_kernel(sigma);
    double sum = 0.0;
    double variance = 0.0;
    for (int i = -kernel.radius; i <= kernel.radius; ++i) {
      sum += static_cast<double>(weight(kernel, i));
      variance += i * i * static_cast<double>(weight(kernel, i));
    }
    EXPECT_NEAR(sum, 1.0, 1e-6);
    EXPECT_NEAR(std::sqrt(variance), sigma, 1e-5 * sigma);
    EXPECT_LE(kernel.radius, kMaxKernelRadius);
  }
}

TEST(BlurColumns, EqualsTheSumWrittenOut) {
  std::mt19937 random(7);
  for (const double sigma : {0.7, 1.6, 3.1}) {
    const GaussianKernel kernel = make_gaussian_kernel(sigma);
    for (const int width : {1, 15, 16, 33, 100}) {
      std::vector<Row> rows;
      std::vector<const float*> pointers;
      const int row_count = 2 * kernel.radius + kRowsAtOnce;
      for (int t = 0; t < row_count; ++t) {
        rows.emplace_back(width, random);
      }
      for (Row& row : rows) {
        pointers.push_back(row.begin());
      }
      std::vector<Row> out(kRowsAtOnce, Row(width));
      blur_columns(kernel,
                   pointers.data(),
                   width,
                   {out[0].begin(), out[1].begin(), out[2].begin(), out[3].begin()});
      for (int j = 0; j < kRowsAtOnce; ++j) {
        for (int x = 0; x < width; ++x) {
          double expected = 0.0;
          for (int t = -kernel.radius; t <= kernel.radius; ++t) {
            const auto row = static_cast<std::size_t>(j + t + kernel.radius);
            expected +=
                static_cast<double>(weight(kernel, t)) * static_cast<double>(rows[row].at(x));
          }
          ASSERT_NEAR(static_cast<double>(out[static_cast<std::size_t>(j)].at(x)), expected, 1e-3);
        }
      }
    }
  }
}

TEST(BlurRow, EqualsTheSumWrittenOutAndSubtractsTheFinerLevel) {
  std::mt19937 random(8);
  const GaussianKernel kernel = make_gaussian_kernel(2.45);
  for (const int width : {1, 17, 64, 131}) {
    Row row(width, random);
    Row finer(width, random);
    Row blurred(width);
    Row difference(width);
    blur_row(kernel, row.begin(), width, blurred.begin(), finer.begin(), difference.begin());
    for (int x = 0; x < width; ++x) {
      double expected = 0.0;
      for (int t = -kernel.radius; t <= kernel.radius; ++t) {
        expected += static_cast<double>(weight(kernel, t)) * static_cast<double>(row.at(x + t));
      }
      ASSERT_NEAR(static_cast<double>(blurred.at(x)), expected, 1e-3);
      ASSERT_EQ(difference.at(x), blurred.at(x) - finer.at(x));
    }
  }
}

TEST(QuantiseRow, KeepsAFractionOfOneIn256AndTheFullRange) {
  Row row(37);
  for (int x = 0; x < 37; ++x) {
    row.begin()[x] = 255.0F * static_cast<float>(x) / 36.0F;
  }
  std::vector<std::uint16_t> out(37 + kRowSlack);
  quantise_row(row.begin(), 37, out.data());
  for (int x = 0; x < 37; ++x) {
    EXPECT_NEAR(
        static_cast<float>(out[static_cast<std::size_t>(x)]) / 256.0F, row.at(x), 0.5 / 256);
  }
  EXPECT_EQ(out[36], 255 * 256);
}

/// Three layers of three rows, and the pointers to them.
struct Layers {
  explicit Layers(int width) : rows(9, Row(width)) {}

  Neighbourhood pointers() {
    Neighbourhood out{};
    for (std::size_t i = 0; i < 9; ++i) {
      out[i / 3][i % 3] = rows[i].begin();
    }
    return out;
  }

  Row& centre() { return rows[4]; }

  std::vector<Row> rows;
};

bool is_strict_extremum(Layers& layers, int x, float threshold) {
  const float v = layers.centre().at(x);
  bool is_highest = true;
  bool is_lowest = true;
  for (std::size_t i = 0; i < 9; ++i) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (i != 4 || dx != 0) {
        is_highest = is_highest && v > layers.rows[i].at(x + dx);
        is_lowest = is_lowest && v < layers.rows[i].at(x + dx);
      }
    }
  }
  return std::abs(v) > threshold && (is_highest || is_lowest);
}

TEST(FindExtrema, AgreesWithBruteForceOnNoise) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> value(-10.0F, 10.0F);
  constexpr int kWidth = 4000;
  Layers layers(kWidth);
  for (Row& row : layers.rows) {
    std::generate_n(row.begin(), kWidth, [&] { return value(random); });
  }
  std::vector<int> expected;
  for (int x = 3; x < kWidth - 1; ++x) {
    if (is_strict_extremum(layers, x, 8.0F)) {
      expected.push_back(x);
    }
  }
  ASSERT_GT(expected.size(), 50U);
  std::vector<int> found;
  find_extrema(layers.pointers(), 8.0F, 3, kWidth - 1, found);
  EXPECT_THAT(found, ElementsAreArray(expected));
}

TEST(FindExtrema, TakesOneOfTwoEqualNeighbours) {
  Layers layers(40);
  layers.centre().begin()[20] = -5.0F;
  layers.centre().begin()[21] = -5.0F;
  std::vector<int> found;
  find_extrema(layers.pointers(), 1.0F, 1, 39, found);
  EXPECT_THAT(found, ElementsAre(21));
}

TEST(FindExtrema, LeavesOutPlateausWeakPointsAndColumnsOutsideTheRange) {
  Layers layers(40);
  std::vector<int> found;
  layers.centre().begin()[10] = 0.9F;   // below the threshold
  layers.centre().begin()[35] = 50.0F;  // behind the range
  find_extrema(layers.pointers(), 1.0F, 1, 35, found);
  EXPECT_THAT(found, IsEmpty());
  for (Row& row : layers.rows) {
    std::fill_n(row.begin(), 40, 7.0F);
  }
  find_extrema(layers.pointers(), 1.0F, 1, 39, found);
  EXPECT_THAT(found, IsEmpty());
}

}  // namespace
}  // namespace trigmesh::sift
