#include "sfm/keyframes/keyframe_selector.hpp"

#include <map>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "tests/support/textured_image.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr std::uint64_t kSwing = 6;  // frames

/// A long wall along which the camera walks.
const cv::Mat& wall() {
  static const cv::Mat image = test_support::textured_image(6000, kHeight, 11);
  return image;
}

cv::Mat view_at(double x_px) {
  const cv::Mat motion = (cv::Mat_<double>(2, 3) << 1, 0, -x_px, 0, 1, 0);
  cv::Mat view;
  cv::warpAffine(wall(), view, motion, {kWidth, kHeight}, cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return view;
}

cv::Mat blurred(const cv::Mat& image, double sigma_px = 3.0) {
  cv::Mat result;
  cv::GaussianBlur(image, result, {}, sigma_px);
  return result;
}

class KeyframeSelectorTest : public ::testing::Test {
 protected:
  void offer(const cv::Mat& grey) {
    const std::uint64_t id = next_id_++;
    take(selector_.offer({id, milliseconds(33 * id), grey}));
  }

  void finish() { take(selector_.finish()); }

  /// A steady walk with a swing, in which pictures are a little blurred.
  void walk_with_swing_at(std::uint64_t first) {
    double x_px = 0.0;
    for (std::uint64_t i = 0; i < first + 40; ++i) {
      const bool is_swing = i >= first && i < first + kSwing;
      offer(is_swing ? blurred(view_at(x_px), 0.7) : view_at(x_px));
      x_px += is_swing ? 22.0 : 3.0;
    }
    finish();
  }

  /// Frames before `end` since the last keyframe that had moved.
  [[nodiscard]] std::vector<std::uint64_t> passed_over(std::uint64_t keyframe,
                                                       std::uint64_t end) const {
    std::vector<std::uint64_t> passed;
    for (std::uint64_t id = keyframe - 1; decisions_.at(id).verdict != FrameVerdict::kKept; --id) {
      const double motion_deg = decisions_.at(id).measures.motion_deg;
      if (id < end && motion_deg >= KeyframeOptions{}.slow_motion_deg) {
        passed.push_back(id);
      }
    }
    return passed;
  }

  void take(std::span<const FrameDecision> decisions) {
    for (const FrameDecision& decision : decisions) {
      const bool is_new = decisions_.emplace(decision.id, decision).second;
      EXPECT_TRUE(is_new) << "frame " << decision.id << " was decided twice";
    }
  }

  [[nodiscard]] std::vector<std::uint64_t> frames_with(FrameVerdict verdict) const {
    std::vector<std::uint64_t> ids;
    for (const auto& [id, decision] : decisions_) {
      if (decision.verdict == verdict) {
        ids.push_back(id);
      }
    }
    return ids;
  }

  KeyframeSelector selector_ = KeyframeSelector::create({}).value();
  std::map<std::uint64_t, FrameDecision> decisions_;
  std::uint64_t next_id_ = 0;
};

TEST_F(KeyframeSelectorTest, KeepsAShareOfASteadyWalk) {
  for (int i = 0; i < 120; ++i) {
    offer(view_at(3.0 * i));
  }
  finish();
  EXPECT_EQ(decisions_.size(), 120U);
  const std::size_t kept = frames_with(FrameVerdict::kKept).size();
  EXPECT_GE(kept, 120U * 8 / 100);
  EXPECT_LE(kept, 120U * 25 / 100);
}

TEST_F(KeyframeSelectorTest, KeepsOneFrameOfACameraThatStandsStill) {
  cv::RNG random(5);
  for (int i = 0; i < 60; ++i) {
    cv::Mat noise(kHeight, kWidth, CV_8SC1);
    random.fill(noise, cv::RNG::NORMAL, 0.0, 1.5);
    cv::Mat view;
    cv::add(view_at(100.0), noise, view, cv::noArray(), CV_8U);
    offer(view);
  }
  finish();
  EXPECT_EQ(frames_with(FrameVerdict::kKept).size(), 1U);
  EXPECT_GE(frames_with(FrameVerdict::kTooLittleMotion).size(), 50U);
}

TEST_F(KeyframeSelectorTest, NamesRepeatedFrames) {
  for (int i = 0; i < 40; ++i) {
    const int step = i / 2;
    offer(view_at(6.0 * step));
  }
  finish();
  EXPECT_EQ(frames_with(FrameVerdict::kDuplicate).size(), 20U);
}

TEST_F(KeyframeSelectorTest, AvoidsBlurredFrames) {
  for (int i = 0; i < 120; ++i) {
    const cv::Mat view = view_at(3.0 * i);
    offer(i % 3 == 0 ? view : blurred(view));
  }
  finish();
  const auto kept = frames_with(FrameVerdict::kKept);
  EXPECT_THAT(kept, Not(IsEmpty()));
  EXPECT_THAT(kept, Each(::testing::ResultOf([](std::uint64_t id) { return id % 3; }, 0U)));
}

TEST_F(KeyframeSelectorTest, PassesOverNoSharpFrameForABlurredOne) {
  std::size_t blurred_keyframes = 0;
  for (std::uint64_t first = 62; first < 66; ++first) {
    decisions_.clear();
    next_id_ = 0;
    walk_with_swing_at(first);
    for (const std::uint64_t id : frames_with(FrameVerdict::kKept)) {
      if (id >= first && id < first + kSwing) {
        ++blurred_keyframes;
        EXPECT_THAT(passed_over(id, first), IsEmpty()) << "swing from " << first << ", kept " << id;
      }
    }
  }
  EXPECT_GT(blurred_keyframes, 0U);
}

TEST_F(KeyframeSelectorTest, HoldsNoMoreFramesThanAllowed) {
  KeyframeOptions options;
  options.max_waiting = 4;
  selector_ = KeyframeSelector::create(options).value();
  for (const double step_px : {0.5, 0.0, 3.0}) {
    for (int i = 0; i < 60; ++i) {
      offer(view_at(step_px * i));
      EXPECT_LT(next_id_ - decisions_.size(), 4U) << "steps of " << step_px << " pixels";
    }
  }
  finish();
  EXPECT_GE(frames_with(FrameVerdict::kKept).size(), 4U);
}

TEST_F(KeyframeSelectorTest, LeavesOutAFlash) {
  for (int i = 0; i < 60; ++i) {
    cv::Mat view = view_at(3.0 * i);
    if (i == 30 || i == 31) {
      view = view * 0.5 + 127;
      view.setTo(250, view > 150);
    }
    offer(view);
  }
  finish();
  EXPECT_THAT(frames_with(FrameVerdict::kExposureJump), ::testing::ElementsAre(30U, 31U));
}

TEST_F(KeyframeSelectorTest, GoesOnInAnotherPlace) {
  for (int i = 0; i < 40; ++i) {
    offer(view_at(3.0 * i));
  }
  for (int i = 0; i < 40; ++i) {
    offer(view_at(3000.0 + 3.0 * i));
  }
  finish();
  const auto kept = frames_with(FrameVerdict::kKept);
  EXPECT_LT(kept.front(), 40U);
  EXPECT_GE(kept.back(), 40U);
  const auto decision = decisions_.at(40).verdict;
  EXPECT_TRUE(decision == FrameVerdict::kTooFast || decision == FrameVerdict::kTrackLost)
      << to_string(decision);
}

TEST_F(KeyframeSelectorTest, KeepsNothingInTheDark) {
  cv::RNG random(5);
  for (int i = 0; i < 40; ++i) {
    cv::Mat dark(kHeight, kWidth, CV_8UC1, cv::Scalar(2));
    dark.at<std::uint8_t>(i, i) = 3;
    offer(dark);
  }
  finish();
  EXPECT_EQ(decisions_.size(), 40U);
  EXPECT_THAT(frames_with(FrameVerdict::kKept), IsEmpty());
}

TEST_F(KeyframeSelectorTest, DecidesTheSameOnASecondRun) {
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 50; ++i) {
      offer(view_at(4.0 * i));
    }
    finish();
  }
  for (std::uint64_t i = 0; i < 50; ++i) {
    EXPECT_EQ(decisions_.at(i).verdict, decisions_.at(i + 50).verdict);
    EXPECT_EQ(decisions_.at(i).measures.motion_deg, decisions_.at(i + 50).measures.motion_deg);
  }
}

TEST(KeyframeOptions, NamesWhatIsWrong) {
  KeyframeOptions options;
  options.min_motion_deg = 5.0;
  const Result<> result = options.validate();
  ASSERT_FALSE(result.has_value());
  EXPECT_THAT(result.error().message, ::testing::HasSubstr("max_motion_deg is 4"));
}

}  // namespace
}  // namespace trigmesh
