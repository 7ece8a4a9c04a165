#include "firmware/pipeline/video_frames.hpp"

#include <stop_token>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "firmware/pipeline/worker_pool.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/textured_image.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

class Silence final : public ProgressListener {
 public:
  void on_progress(const Progress& /*progress*/) override {}
};

using Encoded = std::vector<std::uint8_t>;

/// A camera that pans over a large picture, `step_px` a frame.
std::vector<Encoded> pan(int frames, int step_px) {
  const cv::Mat wall =
      test_support::textured_image(kWidth + frames * step_px, kHeight, /*seed=*/11);
  std::vector<Encoded> result;
  for (int i = 0; i < frames; ++i) {
    result.push_back(*encode_jpeg(wall(cv::Rect(i * step_px, 0, kWidth, kHeight)).clone()));
  }
  return result;
}

PhotoSet video_of(const std::vector<Encoded>& files, milliseconds interval = milliseconds(33)) {
  PhotoSet photos;
  for (std::size_t i = 0; i < files.size(); ++i) {
    photos.names.push_back(std::to_string(i) + ".jpg");
    photos.timestamps.push_back(interval * i);
  }
  photos.ordered = true;
  photos.description = "pan";
  photos.read = [&files](std::size_t i) -> Result<Encoded> { return files[i]; };
  return photos;
}

Result<PhotoSet> choose(const PhotoSet& photos, int threads, std::stop_token stop = {}) {
  const test_support::TemporaryFolder temporary;
  const auto checkpoints = CheckpointFolder::open(temporary.path());
  Silence silence;
  WorkerPool pool(threads, stop, &silence);
  return choose_keyframes(photos, {}, {pool, *checkpoints, silence, stop});
}

std::vector<std::string> verdicts_of(const PhotoSet& chosen) {
  std::vector<std::string> verdicts;
  for (const VideoFrameSection& frame : chosen.frames) {
    verdicts.push_back(frame.name + " " + std::string(to_string(frame.verdict)));
  }
  return verdicts;
}

TEST(FrameUse, NamesComeBack) {
  for (const FrameUse use :
       {FrameUse::kAuto, FrameUse::kAll, FrameUse::kKeyframes, FrameUse::kWalk}) {
    EXPECT_EQ(frame_use_from_string(to_string(use)), use);
  }
  EXPECT_FALSE(frame_use_from_string("some"));
}

TEST(WantsKeyframes, OfAVideoUnlessToldOtherwise) {
  const std::vector<Encoded> files = pan(4, 1);
  const PhotoSet video = video_of(files);
  EXPECT_TRUE(*wants_keyframes(video, FrameUse::kAuto));
  EXPECT_FALSE(*wants_keyframes(video, FrameUse::kAll));
  const PhotoSet slow = video_of(files, milliseconds(150));
  EXPECT_FALSE(*wants_keyframes(slow, FrameUse::kAuto));
  EXPECT_TRUE(*wants_keyframes(slow, FrameUse::kKeyframes));
}

TEST(WantsKeyframes, NotOfPhotographsWithoutTimes) {
  const std::vector<Encoded> files = pan(4, 1);
  PhotoSet photos = video_of(files);
  photos.timestamps.clear();
  EXPECT_FALSE(*wants_keyframes(photos, FrameUse::kAuto));
  const auto refused = wants_keyframes(photos, FrameUse::kKeyframes);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("timestamps.csv"));
}

TEST(ChooseKeyframes, KeepsFewOfManyAndSaysWhatBecameOfEach) {
  const std::vector<Encoded> files = pan(30, 2);
  const PhotoSet video = video_of(files);
  const auto chosen = choose(video, 1);
  ASSERT_TRUE(chosen) << chosen.error().message;
  EXPECT_THAT(chosen->frames, SizeIs(30));
  EXPECT_NEAR(chosen->frames.back().time_s, 29 * 0.033, 1e-9);
  const std::size_t kept = chosen->names.size();
  EXPECT_GT(kept, 3U);
  EXPECT_LT(kept, 20U);
  EXPECT_THAT(chosen->timestamps, SizeIs(kept));
  EXPECT_THAT(chosen->description,
              HasSubstr("pan, " + std::to_string(kept) + " of 30 frames kept"));
  std::size_t position = 0;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (chosen->frames[i].verdict == FrameVerdict::kKept) {
      ASSERT_LT(position, kept);
      EXPECT_EQ(chosen->names[position], video.names[i]);
      EXPECT_EQ(*chosen->read(position), files[i]);
      ++position;
    }
  }
  EXPECT_EQ(position, kept);
}

TEST(ChooseKeyframes, DoesNotDependOnTheNumberOfThreads) {
  const std::vector<Encoded> files = pan(20, 3);
  const PhotoSet video = video_of(files);
  EXPECT_EQ(verdicts_of(*choose(video, 1)), verdicts_of(*choose(video, 3)));
}

TEST(ChooseKeyframes, LeavesFramesThatAreNoPictureToTheNextStage) {
  std::vector<Encoded> files = pan(3, 0);
  files[1] = {1, 2, 3};
  const PhotoSet video = video_of(files);
  const auto chosen = choose(video, 1);
  ASSERT_TRUE(chosen) << chosen.error().message;
  EXPECT_THAT(chosen->names, ElementsAre("0.jpg", "1.jpg"));
  EXPECT_THAT(verdicts_of(*chosen), ElementsAre("0.jpg kept", "2.jpg duplicate"));
}

TEST(ChooseKeyframes, ReadsTheMaskOfTheFrameThatWasKept) {
  std::vector<Encoded> files = pan(30, 2);
  PhotoSet video = video_of(files);
  video.read_mask = [](std::size_t i) -> Result<std::optional<Encoded>> {
    return Encoded{static_cast<std::uint8_t>(i)};
  };
  const auto chosen = choose(video, 1);
  ASSERT_TRUE(chosen) << chosen.error().message;
  const std::size_t last = chosen->names.size() - 1;
  const auto mask = chosen->read_mask(last);
  ASSERT_TRUE(mask && *mask);
  EXPECT_EQ(std::to_string((**mask)[0]) + ".jpg", chosen->names[last]);
}

TEST(ChooseKeyframes, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  const std::vector<Encoded> files = pan(3, 1);
  const PhotoSet video = video_of(files);
  try {
    const auto chosen = choose(video, 1, source.get_token());
    ASSERT_FALSE(chosen);
    EXPECT_EQ(chosen.error().code, ErrorCode::kCancelled);
  } catch (const WorkStopped&) {
    FAIL() << "the stage begins no work after a stop";
  }
}

}  // namespace
}  // namespace trigmesh
