#include "sfm/matching/guided_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/matching/instruction_sets.hpp"
#include "tests/unit/sfm/matching/synthetic_pair.hpp"

namespace trigmesh {
namespace {

using test_support::make_pair;
using test_support::Random;
using test_support::SyntheticPair;

std::vector<std::uint8_t> random_descriptor(Random& random) {
  std::vector<std::uint8_t> out(128);
  for (auto& byte : out) {
    byte = static_cast<std::uint8_t>(random.below(40));
  }
  return out;
}

/// Descriptors for both images of a pair: `looks` different appearances, so that many points look
/// alike.
struct Described {
  FeatureSet first;
  FeatureSet second;

  Described(const SyntheticPair& pair, std::size_t looks, FeatureKind kind = FeatureKind::kSift) {
    Random random(9);
    std::vector<std::vector<std::uint8_t>> appearances;
    for (std::size_t i = 0; i < looks; ++i) {
      appearances.push_back(random_descriptor(random));
    }
    for (FeatureSet* set : {&first, &second}) {
      set->kind = kind;
      set->descriptor_bytes = 128;
      for (std::size_t i = 0; i < pair.first.size(); ++i) {
        set->keypoints.emplace_back();
        auto descriptor = appearances[i % looks];
        descriptor[random.below(128)] += 1;
        set->descriptors.insert(set->descriptors.end(), descriptor.begin(), descriptor.end());
      }
    }
  }
};

/// Brute force over all pairs, straight from the contract.
std::vector<FeatureMatch> slow_guided(const GuidedImage& a,
                                      const GuidedImage& b,
                                      const Eigen::Matrix3d& f,
                                      const GuidedMatchOptions& options) {
  struct Two {
    double best = 0.0;
    double second = 0.0;
    std::size_t position = 0;

    void take_in(double score, std::size_t where) {
      second = std::max(second, std::min(best, score));
      if (score > best) {
        best = score;
        position = where;
      }
    }
  };

  std::vector<Two> rows(a.index.size());
  std::vector<Two> columns(b.index.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < columns.size(); ++j) {
      const Eigen::Vector3d x = a.points_px[i].homogeneous();
      const Eigen::Vector3d y = b.points_px[j].homogeneous();
      const double error = std::abs(y.dot(f * x));
      if (!(error <= options.max_error_px * (f * x).head<2>().norm()) ||
          !(error <= options.max_error_px * (f.transpose() * y).head<2>().norm())) {
        continue;
      }
      const double score = internal::similarity(a.index.rows(), i, b.index.rows(), j);
      rows[i].take_in(score, j);
      columns[j].take_in(score, i);
    }
  }
  std::vector<FeatureMatch> out;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::size_t j = rows[i].position;
    if (rows[i].best == 0.0 || columns[j].position != i) {
      continue;
    }
    const DescriptorMetric metric = a.index.rows().metric;
    const bool bits = metric == DescriptorMetric::kHamming;
    const double scale = bits ? 8.0 * 128.0 : a.index.length(i) * b.index.length(j);
    const double similarity = rows[i].best / scale;
    const double distance = bits ? 1.0 - similarity : std::sqrt(0.5 - 0.5 * similarity);
    if (distance <= options.max_distance &&
        passes_ratio_test(metric, rows[i].best, rows[i].second, scale, options.max_ratio) &&
        passes_ratio_test(metric, columns[j].best, columns[j].second, scale, options.max_ratio)) {
      out.push_back({id_of<FeatureIndex>(i), id_of<FeatureIndex>(j)});
    }
  }
  return out;
}

TEST(MatchGuided, AgreesWithBruteForceForManyMotionsAndInstructionSets) {
  const std::vector<Rigid3> motions = {
      {Eigen::Quaterniond::Identity(), {-1.0, 0.0, 0.0}},
      {Eigen::Quaterniond::Identity(), {0.0, -1.0, 0.0}},
      {Eigen::Quaterniond::Identity(), {0.1, 0.0, -1.5}},
      {Eigen::Quaterniond(Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ())), {-0.6, 0.5, 0.1}},
  };
  for (const FeatureKind kind : {FeatureKind::kSift, FeatureKind::kAkaze}) {
    for (const Rigid3& motion : motions) {
      const SyntheticPair pair =
          make_pair({.true_count = 400, .outlier_count = 100, .second_from_first = motion});
      const Described described(pair, 150, kind);
      const auto first = DescriptorIndex::build(described.first);
      const auto second = DescriptorIndex::build(described.second);
      const GuidedImage a{*first, pair.first};
      const GuidedImage b{*second, pair.second};
      const auto expected = slow_guided(a, b, pair.fundamental, {});
      EXPECT_GT(expected.size(), 200U);
      test_support::for_each_instruction_set(
          [&] { EXPECT_EQ(match_guided(a, b, pair.fundamental, {}), expected); });
    }
  }
}

TEST(MatchGuided, FindsRepeatedTextureThatTheRatioTestRefuses) {
  const SyntheticPair pair = make_pair({.true_count = 600});
  const Described described(pair, 100);
  const auto first = DescriptorIndex::build(described.first);
  const auto second = DescriptorIndex::build(described.second);
  EXPECT_LT(match_descriptors(*first, *second, {}).size(), 150U);
  const auto matches =
      match_guided({*first, pair.first}, {*second, pair.second}, pair.fundamental, {});
  const auto right = std::count_if(matches.begin(), matches.end(), [](const FeatureMatch& match) {
    return index(match.first) == index(match.second);
  });
  EXPECT_GT(right, 400);
  EXPECT_GT(static_cast<double>(right), 0.95 * static_cast<double>(matches.size()));
}

TEST(MatchGuided, RefusesDescriptorsThatAreFarApart) {
  const SyntheticPair pair = make_pair({.true_count = 200});
  const Described some(pair, 200);
  Described other(pair, 200);
  Random random(77);
  for (auto& byte : other.second.descriptors) {
    byte = static_cast<std::uint8_t>(random.below(40));
  }
  const auto first = DescriptorIndex::build(some.first);
  const auto second = DescriptorIndex::build(other.second);
  const GuidedMatchOptions strict{.max_ratio = 1.0, .max_distance = 0.2};
  EXPECT_TRUE(
      match_guided({*first, pair.first}, {*second, pair.second}, pair.fundamental, strict).empty());
}

TEST(MatchGuided, SurvivesDegenerateInput) {
  SyntheticPair pair = make_pair({.true_count = 50});
  const Described described(pair, 50);
  const auto first = DescriptorIndex::build(described.first);
  const auto second = DescriptorIndex::build(described.second);
  EXPECT_TRUE(
      match_guided({*first, pair.first}, {*second, pair.second}, Eigen::Matrix3d::Zero(), {})
          .empty());
  pair.first[4].x() = std::numeric_limits<double>::quiet_NaN();
  pair.second[9].y() = std::numeric_limits<double>::infinity();
  const auto matches =
      match_guided({*first, pair.first}, {*second, pair.second}, pair.fundamental, {});
  EXPECT_THAT(
      matches,
      testing::Not(testing::Contains(testing::Field(&FeatureMatch::first, FeatureIndex{4}))));
  EXPECT_THAT(
      matches,
      testing::Not(testing::Contains(testing::Field(&FeatureMatch::second, FeatureIndex{9}))));
  EXPECT_GT(matches.size(), 40U);
  for (Eigen::Vector2d& point : pair.second) {
    point.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  EXPECT_TRUE(
      match_guided({*first, pair.first}, {*second, pair.second}, pair.fundamental, {}).empty());
  const auto empty = DescriptorIndex::build(FeatureSet{});
  EXPECT_TRUE(match_guided({*empty, {}}, {*second, pair.second}, pair.fundamental, {}).empty());
}

TEST(GuidedMatchOptions, RefusesValuesOutOfRange) {
  EXPECT_TRUE(GuidedMatchOptions{}.validate().has_value());
  EXPECT_FALSE(GuidedMatchOptions{.max_error_px = 0.0}.validate().has_value());
  EXPECT_FALSE(GuidedMatchOptions{.max_ratio = 1.5}.validate().has_value());
  EXPECT_FALSE(GuidedMatchOptions{.max_distance = 0.0}.validate().has_value());
}

}  // namespace
}  // namespace trigmesh
