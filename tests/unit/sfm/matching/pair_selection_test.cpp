#include "sfm/matching/pair_selection.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/random.hpp"

namespace trigmesh {
namespace {

using test_support::Random;

ImagePair pair_of(std::size_t i, std::size_t j) {
  return {id_of<ViewId>(i), id_of<ViewId>(j)};
}

/// Calls the work backwards: the result must not depend on the order.
class BackwardExecutor final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    for (std::size_t i = count; i > 0; --i) {
      work(i - 1);
    }
  }
};

/// Images along a path: each sees 60 of the things that stand along it, 20 of them new.
class Walk {
 public:
  Walk(std::size_t images, FeatureKind kind, std::size_t bytes) {
    Random random(4);
    const int largest = descriptor_metric(kind) == DescriptorMetric::kDotProduct ? 39 : 255;
    std::vector<std::vector<std::uint8_t>> things(20 * images + 60,
                                                  std::vector<std::uint8_t>(bytes));
    for (auto& thing : things) {
      for (auto& byte : thing) {
        byte = static_cast<std::uint8_t>(random.below(static_cast<std::size_t>(largest) + 1));
      }
    }
    sets_.resize(images);
    for (std::size_t i = 0; i < images; ++i) {
      sets_[i].kind = kind;
      sets_[i].descriptor_bytes = bytes;
      for (std::size_t t = 20 * i; t < 20 * i + 60; ++t) {
        auto descriptor = things[t];
        descriptor[random.below(bytes)] ^= 1;
        sets_[i].keypoints.emplace_back();
        sets_[i].descriptors.insert(
            sets_[i].descriptors.end(), descriptor.begin(), descriptor.end());
      }
    }
    index();
  }

  explicit Walk(std::size_t images) : Walk(images, FeatureKind::kSift, 128) {}

  /// Image `copy` shows what image `original` shows.
  void close_loop(std::size_t original, std::size_t copy) {
    sets_[copy] = sets_[original];
    index();
  }

  void clear(std::size_t image) {
    sets_[image].keypoints.clear();
    sets_[image].descriptors.clear();
    index();
  }

  [[nodiscard]] std::vector<ImagePair> select(const PairSelectionOptions& options) const {
    SerialExecutor executor;
    auto pairs = select_pairs(indexes_, options, executor);
    EXPECT_TRUE(pairs.has_value());
    EXPECT_TRUE(std::is_sorted(pairs->begin(), pairs->end()));
    EXPECT_EQ(std::adjacent_find(pairs->begin(), pairs->end()), pairs->end());
    for (const ImagePair& pair : *pairs) {
      EXPECT_LT(pair.first, pair.second);
    }
    return *pairs;
  }

  [[nodiscard]] const std::vector<DescriptorIndex>& indexes() const { return indexes_; }

 private:
  void index() {
    indexes_.clear();
    for (const FeatureSet& set : sets_) {
      indexes_.push_back(DescriptorIndex::build(set).value());
    }
  }

  std::vector<FeatureSet> sets_;
  std::vector<DescriptorIndex> indexes_;
};

TEST(SelectPairs, ExhaustiveTakesAllPairsOfImagesWithFeatures) {
  Walk walk(6);
  EXPECT_EQ(walk.select({.mode = PairMode::kExhaustive}).size(), 15U);
  walk.clear(2);
  const auto pairs = walk.select({.mode = PairMode::kExhaustive});
  EXPECT_EQ(pairs.size(), 10U);
  for (const ImagePair& pair : pairs) {
    EXPECT_TRUE(index(pair.first) != 2 && index(pair.second) != 2);
  }
}

TEST(SelectPairs, SequentialTakesTheWindow) {
  const Walk walk(10);
  const auto pairs = walk.select({.mode = PairMode::kSequential, .window = 2, .loop_neighbors = 0});
  EXPECT_EQ(pairs.size(), 9U + 8U);
  EXPECT_THAT(pairs, testing::Contains(pair_of(3, 5)));
  EXPECT_THAT(pairs, testing::Not(testing::Contains(pair_of(3, 6))));
}

TEST(SelectPairs, SequentialClosesLoops) {
  Walk walk(30);
  walk.close_loop(0, 29);
  const auto pairs = walk.select({.mode = PairMode::kSequential, .window = 2, .loop_neighbors = 1});
  EXPECT_THAT(pairs, testing::Contains(pair_of(0, 29)));
}

TEST(SelectPairs, RetrievalFindsWhatOverlapsForBothMetrics) {
  for (const auto& walk : {Walk(40), Walk(40, FeatureKind::kOrb, 32)}) {
    const auto pairs = walk.select({.mode = PairMode::kRetrieval, .neighbors = 4});
    EXPECT_LE(pairs.size(), 160U);
    for (std::size_t i = 0; i + 2 < 40; ++i) {
      EXPECT_THAT(pairs, testing::Contains(pair_of(i, i + 1)));
    }
  }
}

TEST(SelectPairs, AutomaticKeepsWhatOverlapsAndLittleElse) {
  const Walk walk(30);
  const auto pairs = walk.select({});
  for (std::size_t i = 0; i + 2 < 30; ++i) {
    EXPECT_THAT(pairs, testing::Contains(pair_of(i, i + 1)));
    EXPECT_THAT(pairs, testing::Contains(pair_of(i, i + 2)));
  }
  EXPECT_LT(pairs.size(), 100U);  // 57 overlap, 435 in all
}

TEST(SelectPairs, AutomaticUsesRetrievalForLargeSets) {
  const Walk walk(30);
  const auto pairs = walk.select({.neighbors = 6, .max_exhaustive_images = 10});
  EXPECT_LE(pairs.size(), 180U);
  for (std::size_t i = 0; i + 1 < 30; ++i) {
    EXPECT_THAT(pairs, testing::Contains(pair_of(i, i + 1)));
  }
}

TEST(SelectPairs, AutomaticAlwaysTakesTheWindowOfASequence) {
  Walk walk(12);
  const auto pairs = walk.select({.order = ImageOrder::kSequence, .window = 5});
  EXPECT_THAT(pairs, testing::Contains(pair_of(2, 7)));
}

TEST(SelectPairs, DoesNotDependOnTheOrderOfExecution) {
  const Walk walk(20);
  SerialExecutor forward;
  BackwardExecutor backward;
  for (const PairMode mode :
       {PairMode::kExhaustive, PairMode::kSequential, PairMode::kRetrieval, PairMode::kAuto}) {
    const PairSelectionOptions options{.mode = mode, .max_exhaustive_images = 10};
    EXPECT_EQ(select_pairs(walk.indexes(), options, forward).value(),
              select_pairs(walk.indexes(), options, backward).value());
  }
}

TEST(SelectPairs, HandlesNoImagesOneImageAndEmptyImages) {
  SerialExecutor executor;
  for (const PairMode mode :
       {PairMode::kExhaustive, PairMode::kSequential, PairMode::kRetrieval, PairMode::kAuto}) {
    EXPECT_TRUE(select_pairs({}, {.mode = mode}, executor).value().empty());
    EXPECT_TRUE(Walk(1).select({.mode = mode}).empty());
    Walk walk(3);
    walk.clear(0);
    walk.clear(1);
    EXPECT_TRUE(walk.select({.mode = mode}).empty());
    walk.clear(2);
    EXPECT_TRUE(walk.select({.mode = mode}).empty());
  }
}

TEST(SelectPairs, RefusesOptionsOutOfRange) {
  SerialExecutor executor;
  EXPECT_EQ(select_pairs({}, {.window = 0}, executor).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(select_pairs({}, {.neighbors = 0}, executor).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(select_pairs({}, {.preemptive_features = 0}, executor).error().code,
            ErrorCode::kInvalidArgument);
  PairSelectionOptions options;
  options.global_descriptor.words = 1;
  EXPECT_EQ(select_pairs({}, options, executor).error().code, ErrorCode::kInvalidArgument);
}

TEST(DescribeImages, GivesUnitVectorsThatAreNearForTheSameImage) {
  Walk walk(10);
  walk.close_loop(1, 8);
  walk.clear(5);
  SerialExecutor executor;
  const auto described = describe_images(walk.indexes(), {}, executor);
  ASSERT_EQ(described.size(), 10U);
  EXPECT_NEAR(described[0].norm(), 1.0F, 1e-5F);
  EXPECT_NEAR(described[1].dot(described[8]), 1.0F, 1e-5F);
  EXPECT_EQ(described[5].norm(), 0.0F);
  EXPECT_EQ(described[5].size(), described[0].size());
  EXPECT_GT(described[2].dot(described[3]), described[2].dot(described[9]));
}

TEST(PairModeNames, GoBothWays) {
  for (const PairMode mode :
       {PairMode::kExhaustive, PairMode::kSequential, PairMode::kRetrieval, PairMode::kAuto}) {
    EXPECT_EQ(pair_mode_from_string(to_string(mode)), mode);
  }
  EXPECT_EQ(pair_mode_from_string("some"), std::nullopt);
}

}  // namespace
}  // namespace trigmesh
