#include "firmware/pipeline/sequence_matching.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/base/executor.hpp"
#include "firmware/pipeline/matching_stage.hpp"
#include "firmware/pipeline/worker_pool.hpp"
#include "tests/support/random.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using test_support::Random;
using test_support::TemporaryFolder;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::size_t kDescriptorBytes = 128;
constexpr std::size_t kPointsPerMetre = 60;
constexpr double kWallLength = 30.0;
constexpr double kStep = 0.25;

using Descriptor = std::array<std::uint8_t, kDescriptorBytes>;

/// A random vector of the length that SIFT's have.
Descriptor descriptor_of(std::uint64_t point) {
  Random random(point + 1);
  std::array<double, kDescriptorBytes> values{};
  double squares = 0.0;
  for (double& value : values) {
    value = std::abs(random.normal());
    squares += value * value;
  }
  Descriptor descriptor{};
  for (std::size_t i = 0; i < kDescriptorBytes; ++i) {
    descriptor[i] = static_cast<std::uint8_t>(values[i] * 512.0 / std::sqrt(squares) / 2.0);
  }
  return descriptor;
}

Camera camera() {
  return {.model = CameraModel::kPinhole,
          .width_px = 640,
          .height_px = 480,
          .fx_px = 500.0,
          .fy_px = 500.0,
          .cx_px = 319.5,
          .cy_px = 239.5};
}

const CameraGroup kGiven{camera(), IntrinsicsKnowledge::kGiven};

/// A rough wall along x that is seen from 2 m. With a period its look repeats, not its place.
class Wall {
 public:
  explicit Wall(double period_m = 0.0) {
    Random random(5);
    const double length = period_m > 0.0 ? period_m : kWallLength;
    const auto count = static_cast<std::size_t>(length * kPointsPerMetre);
    std::vector<Eigen::Vector3d> stretch;
    for (std::size_t i = 0; i < count; ++i) {
      stretch.emplace_back(
          random.uniform(0.0, length), random.uniform(-0.8, 0.8), random.uniform(2.0, 3.0));
    }
    for (double begin = 0.0; begin < kWallLength; begin += length) {
      for (std::size_t i = 0; i < count; ++i) {
        points_.push_back(stretch[i] + Eigen::Vector3d(begin, 0.0, 0.0));
        looks_.push_back(i);
      }
    }
  }

  [[nodiscard]] ExtractedImage seen_from(double x) const {
    ImageFeatures image;
    image.width_px = 640;
    image.height_px = 480;
    image.features.descriptor_bytes = kDescriptorBytes;
    image.content = static_cast<std::uint64_t>(x * 1e6) + 1;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto pixel = project(camera(), points_[i] - Eigen::Vector3d(x, 0.0, 0.0));
      if (pixel && pixel->x() > 0.0 && pixel->x() < 639.0 && pixel->y() > 0.0 &&
          pixel->y() < 479.0) {
        image.features.keypoints.push_back(
            {static_cast<float>(pixel->x()), static_cast<float>(pixel->y()), 2.0F, 0.0F, 1.0F});
        const Descriptor descriptor = descriptor_of(looks_[i]);
        image.features.descriptors.insert(
            image.features.descriptors.end(), descriptor.begin(), descriptor.end());
      }
    }
    image.colors.resize(image.features.size());
    return {std::move(image), {}};
  }

 private:
  std::vector<Eigen::Vector3d> points_;
  std::vector<std::size_t> looks_;
};

std::vector<ExtractedImage> walk_along(const Wall& wall, const std::vector<double>& places) {
  std::vector<ExtractedImage> images;
  for (const double x : places) {
    images.push_back(wall.seen_from(x));
  }
  return images;
}

std::vector<double> steps(double from, double to) {
  std::vector<double> places;
  const double direction = to > from ? kStep : -kStep;
  for (int i = 0; i * kStep <= std::abs(to - from); ++i) {
    places.push_back(from + i * direction);
  }
  return places;
}

/// There, and back a little beside.
std::vector<double> there_and_back() {
  std::vector<double> places = steps(0.0, 6.0);
  const std::vector<double> back = steps(5.9, 0.1);
  places.insert(places.end(), back.begin(), back.end());
  return places;
}

using PairsOfFrames = std::vector<std::vector<std::uint8_t>>;

class SequenceMatching : public ::testing::Test {
 protected:
  PairsOfFrames match(const std::vector<ExtractedImage>& images,
                      Executor& executor,
                      const CheckpointFolder& checkpoints) {
    auto matcher = SequenceMatcher::create({}, executor, checkpoints);
    PairsOfFrames pairs;
    for (const ExtractedImage& image : images) {
      const auto found = matcher->add({&image, kGiven, CameraId{0}});
      EXPECT_TRUE(found) << found.error().message;
      pairs.push_back(encode_pairs({found->begin(), found->end()}));
    }
    EXPECT_TRUE(matcher->catch_up());
    following_ = matcher->following();
    tracked_ = matcher->tracked_count();
    return pairs;
  }

  PairsOfFrames match(const std::vector<ExtractedImage>& images) {
    const TemporaryFolder folder;
    SerialExecutor executor;
    return match(images, executor, *CheckpointFolder::open(folder.path()));
  }

  SequenceFollowing following_ = SequenceFollowing::kWaiting;
  std::size_t tracked_ = 0;
};

std::vector<PairRecord> all_of(const PairsOfFrames& pairs) {
  std::vector<PairRecord> all;
  for (const auto& bytes : pairs) {
    const auto decoded = decode_pairs(bytes);
    all.insert(all.end(), decoded->begin(), decoded->end());
  }
  return all;
}

/// "first-second kind" of the pairs that are far apart in time.
std::vector<std::string> far_pairs(const PairsOfFrames& pairs, TwoViewKind kind) {
  std::vector<std::string> far;
  for (const PairRecord& record : all_of(pairs)) {
    if (index(record.pair.second) - index(record.pair.first) > 12 && record.geometry.kind == kind) {
      far.push_back(fmt::format("{}-{} with {} matches",
                                index(record.pair.first),
                                index(record.pair.second),
                                record.geometry.inliers.size()));
    }
  }
  return far;
}

TEST_F(SequenceMatching, TracksEveryKeyframeOfAWalkAndClosesItsLoops) {
  const auto images = walk_along(Wall(), there_and_back());
  const PairsOfFrames pairs = match(images);
  EXPECT_EQ(tracked_, images.size());
  EXPECT_EQ(following_, SequenceFollowing::kTracked);
  EXPECT_THAT(far_pairs(pairs, TwoViewKind::kLookAlike), IsEmpty());
  EXPECT_THAT(far_pairs(pairs, TwoViewKind::kGeneral), Not(IsEmpty()));
}

TEST_F(SequenceMatching, TellsALookAlikePlaceFromALoop) {
  const auto images = walk_along(Wall(/*period_m=*/8.0), steps(0.0, 12.0));
  const PairsOfFrames pairs = match(images);
  EXPECT_EQ(tracked_, images.size());
  EXPECT_THAT(far_pairs(pairs, TwoViewKind::kLookAlike), Not(IsEmpty()));
  EXPECT_THAT(far_pairs(pairs, TwoViewKind::kGeneral), IsEmpty());
}

TEST_F(SequenceMatching, WhatIsFoundOfAKeyframeDoesNotDependOnThoseAfterIt) {
  auto images = walk_along(Wall(), there_and_back());
  const PairsOfFrames whole = match(images);
  images.resize(20);
  const PairsOfFrames part = match(images);
  EXPECT_TRUE(std::equal(part.begin(), part.end(), whole.begin()));
}

TEST_F(SequenceMatching, GoesOnFromCheckpointsToTheSameBytesOnMoreThreads) {
  const auto images = walk_along(Wall(), there_and_back());
  const PairsOfFrames whole = match(images);
  const TemporaryFolder folder;
  const auto checkpoints = CheckpointFolder::open(folder.path());
  WorkerPool pool(3);
  auto first_part = walk_along(Wall(), there_and_back());
  first_part.resize(31);
  (void)match(first_part, pool, *checkpoints);
  EXPECT_EQ(match(images, pool, *checkpoints), whole);
  EXPECT_EQ(match(images, pool, *checkpoints), whole);  // all of it from checkpoints
  EXPECT_EQ(tracked_, images.size());
}

/// All keyframes at hand: pairs of blocks of them.
std::vector<std::uint8_t> match_in_blocks(const std::vector<ExtractedImage>& images,
                                          Executor& executor,
                                          const CheckpointFolder& checkpoints) {
  constexpr std::size_t kBlock = 7;
  std::vector<SequenceKeyframe> keyframes;
  for (const ExtractedImage& image : images) {
    keyframes.push_back({&image, kGiven, CameraId{0}});
  }
  auto matcher = SequenceMatcher::create({}, executor, checkpoints);
  std::atomic<std::size_t> compared = 0;
  for (std::size_t begin = 0; begin < keyframes.size(); begin += kBlock) {
    const std::size_t count = std::min(kBlock, keyframes.size() - begin);
    EXPECT_TRUE(matcher->add_block(std::span(keyframes).subspan(begin, count),
                                   [&compared] { ++compared; }));
  }
  EXPECT_EQ(compared, images.size());
  return encode_pairs(*matcher->all_pairs());
}

TEST_F(SequenceMatching, BlocksGiveTheSameBytesAsOneByOneAlsoFromCheckpoints) {
  auto images = walk_along(Wall(/*period_m=*/8.0), steps(0.0, 12.0));
  images.insert(images.begin() + 20,
                ExtractedImage{std::nullopt, {ErrorCode::kCorruptData, "torn"}});
  const std::vector<std::uint8_t> expected = encode_pairs(all_of(match(images)));
  const TemporaryFolder folder;
  const auto checkpoints = CheckpointFolder::open(folder.path());
  WorkerPool pool(3);
  auto first_part = images;
  first_part.resize(24);
  (void)match_in_blocks(first_part, pool, *checkpoints);
  EXPECT_EQ(match_in_blocks(images, pool, *checkpoints), expected);
  EXPECT_EQ(match_in_blocks(images, pool, *checkpoints), expected) << "all of it from checkpoints";
  EXPECT_EQ(encode_pairs(all_of(match(images, pool, *checkpoints))), expected);
}

TEST_F(SequenceMatching, ACheckpointOfAnotherPastIsNotUsed) {
  auto images = walk_along(Wall(), steps(0.0, 4.0));
  const TemporaryFolder folder;
  const auto checkpoints = CheckpointFolder::open(folder.path());
  SerialExecutor executor;
  (void)match(images, executor, *checkpoints);
  images.erase(images.begin() + 3);
  EXPECT_EQ(match(images, executor, *checkpoints), match(images));
}

TEST_F(SequenceMatching, WaitsForParallaxAndTellsWhenItIsLost) {
  auto images = walk_along(Wall(), steps(0.0, 0.5));
  (void)match(images);
  EXPECT_EQ(following_, SequenceFollowing::kWaiting);
  images = walk_along(Wall(), steps(0.0, 3.0));
  images.push_back(Wall().seen_from(20.0));
  (void)match(images);
  EXPECT_EQ(following_, SequenceFollowing::kLost);
}

TEST_F(SequenceMatching, AKeyframeThatCannotBeReadIsLeftOut) {
  auto images = walk_along(Wall(), steps(0.0, 3.0));
  const ExtractedImage unreadable{std::nullopt, {ErrorCode::kCorruptData, "torn"}};
  images.insert(images.begin() + 4, unreadable);
  images.insert(images.begin(), unreadable);
  images.push_back(unreadable);
  (void)match(images);
  EXPECT_EQ(tracked_, images.size() - 3);
  EXPECT_EQ(following_, SequenceFollowing::kLost);
}

}  // namespace
}  // namespace trigmesh
