#include "firmware/daemon/guide.hpp"

#include <algorithm>
#include <array>

namespace trigmesh {
namespace {

/// About a second of a usual camera.
constexpr std::size_t kLatest = 30;
/// Fewer frames say nothing.
constexpr std::size_t kFewest = 8;
/// Of 255: with automatic exposure and gain at their ends, sensors are noise below this.
constexpr double kDarkBrightness = 35.0;
/// Of the latest frames, a third is a habit.
constexpr std::size_t kHabit = 3;
/// So blurred that a feature is found at half the places at best.
constexpr double kBlurredSharpness = 0.5;
constexpr std::size_t kLostInRow = 2;
constexpr std::size_t kWaitedLong = 10;
constexpr std::size_t kEnoughPhotographs = 24;

bool is_too_fast(const FrameJudged& frame) {
  return frame.verdict == FrameVerdict::kTooFast || frame.verdict == FrameVerdict::kTrackLost;
}

bool is_blurred(const FrameJudged& frame) {
  return frame.verdict == FrameVerdict::kBlurred &&
         frame.measures.relative_sharpness < kBlurredSharpness;
}

}  // namespace

std::string_view to_string(Advice advice) {
  constexpr std::array<std::string_view, 7> kNames = {
      "none", "go back", "more light", "slower", "hold steady", "step sideways", "enough"};
  return kNames[static_cast<std::size_t>(advice)];
}

std::string_view sentence_of(Advice advice) {
  constexpr std::array<std::string_view, 7> kSentences = {
      "go on like that",
      "lost: go back to the last good view and from there on slowly",
      "too dark: more light, or a longer exposure and a steadier hand",
      "too fast: move slower, so that each view shares most of the last one",
      "blurred: hold the camera steadier or move slower",
      "no depth so far: step sideways, do not only turn the camera",
      "the walk came around and everything connects: enough"};
  return kSentences[static_cast<std::size_t>(advice)];
}

void Guide::begin() {
  *this = Guide();
}

void Guide::see(std::span<const FrameJudged> frames) {
  latest_.insert(latest_.end(), frames.begin(), frames.end());
  while (latest_.size() > kLatest) {
    latest_.pop_front();
  }
}

void Guide::follow(const MapFollowed& map) {
  map_ = map;
  lost_in_row_ = map.frame.following == MapFollowing::kLost ? lost_in_row_ + 1 : 0;
  came_around_ = came_around_ || map.closes_loop;
}

std::size_t Guide::count_latest(bool (*is_meant)(const FrameJudged&)) const {
  return static_cast<std::size_t>(std::count_if(latest_.begin(), latest_.end(), is_meant));
}

bool Guide::is_dark() const {
  double sum = 0.0;
  for (const FrameJudged& frame : latest_) {
    sum += frame.measures.brightness;
  }
  return sum < kDarkBrightness * static_cast<double>(latest_.size());
}

Advice Guide::advice() const {
  if (lost_in_row_ >= kLostInRow) {
    return Advice::kGoBack;
  }
  if (latest_.size() >= kFewest) {
    if (is_dark()) {
      return Advice::kMoreLight;
    }
    if (kHabit * count_latest(is_too_fast) >= latest_.size()) {
      return Advice::kSlower;
    }
    if (kHabit * count_latest(is_blurred) >= latest_.size()) {
      return Advice::kHoldSteady;
    }
  }
  if (map_.frame.following == MapFollowing::kWaiting && map_.photographs >= kWaitedLong) {
    return Advice::kStepSideways;
  }
  const bool connects = 10 * map_.tracked >= 9 * map_.photographs;
  return came_around_ && connects && map_.tracked >= kEnoughPhotographs ? Advice::kEnough
                                                                        : Advice::kNone;
}

}  // namespace trigmesh
