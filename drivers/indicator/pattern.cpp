#include "drivers/indicator/pattern.hpp"

#include <algorithm>
#include <array>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr IndicatorLevels kDark{.light = false, .buzzer = false};
constexpr IndicatorLevels kLight{.light = true, .buzzer = false};
constexpr IndicatorLevels kBoth{.light = true, .buzzer = true};

constexpr std::array kDarkForEver = {PatternStep{kDark, milliseconds(1000)}};
constexpr std::array kLightForEver = {PatternStep{kLight, milliseconds(1000)}};
constexpr std::array kIdleSteps = {PatternStep{kLight, milliseconds(60)},
                                   PatternStep{kDark, milliseconds(2940)}};
constexpr std::array kSlowerSteps = {PatternStep{kBoth, milliseconds(80)},
                                     PatternStep{kDark, milliseconds(120)}};
constexpr std::array kLostSteps = {PatternStep{kBoth, milliseconds(500)},
                                   PatternStep{kDark, milliseconds(500)}};
constexpr std::array kStorageLowSteps = {PatternStep{kBoth, milliseconds(100)},
                                         PatternStep{kDark, milliseconds(150)},
                                         PatternStep{kLight, milliseconds(100)},
                                         PatternStep{kDark, milliseconds(150)},
                                         PatternStep{kLight, milliseconds(100)},
                                         PatternStep{kDark, milliseconds(2400)}};
constexpr std::array kWorkingSteps = {PatternStep{kLight, milliseconds(800)},
                                      PatternStep{kDark, milliseconds(800)}};
constexpr std::array kDoneSteps = {PatternStep{kBoth, milliseconds(120)},
                                   PatternStep{kLight, milliseconds(120)},
                                   PatternStep{kBoth, milliseconds(120)},
                                   PatternStep{kLight, milliseconds(2640)},
                                   PatternStep{kDark, milliseconds(1)}};
constexpr std::array kFailedStart = {PatternStep{kBoth, milliseconds(1000)},
                                     PatternStep{kDark, milliseconds(500)}};
constexpr std::array kFailedSteps = {PatternStep{kLight, milliseconds(150)},
                                     PatternStep{kDark, milliseconds(150)},
                                     PatternStep{kLight, milliseconds(150)},
                                     PatternStep{kDark, milliseconds(1050)}};

nanoseconds length_of(std::span<const PatternStep> steps) {
  nanoseconds length{0};
  for (const PatternStep& step : steps) {
    length += step.duration;
  }
  return length;
}

/// A step and when it ends, since the pattern began.
struct Place {
  const PatternStep* step = nullptr;
  nanoseconds end{0};
};

/// The step of `steps` that holds at `elapsed`, which lies within them; they began at `begin`.
Place place_in(std::span<const PatternStep> steps, nanoseconds begin, nanoseconds elapsed) {
  nanoseconds end = begin;
  for (const PatternStep& step : steps) {
    end += step.duration;
    if (elapsed < end) {
      return {&step, end};
    }
  }
  return {&steps.back(), end};
}

Place place_at(const PatternSteps& steps, nanoseconds elapsed) {
  elapsed = std::max(elapsed, nanoseconds(0));
  const nanoseconds first = length_of(steps.once);
  if (elapsed < first || steps.repeated.empty()) {
    return place_in(steps.once, nanoseconds(0), elapsed);
  }
  const nanoseconds period = length_of(steps.repeated);
  return place_in(steps.repeated, elapsed - (elapsed - first) % period, elapsed);
}

}  // namespace

std::string_view to_string(IndicatorPattern pattern) {
  constexpr std::array<std::string_view, kPatternCount> kNames = {
      "off", "idle", "capturing", "slower", "lost", "storage low", "working", "done", "failed"};
  return kNames[static_cast<std::size_t>(pattern)];
}

PatternSteps steps_of(IndicatorPattern pattern) {
  switch (pattern) {
    case IndicatorPattern::kOff:
      break;
    case IndicatorPattern::kIdle:
      return {{}, kIdleSteps};
    case IndicatorPattern::kCapturing:
      return {kLightForEver, {}};
    case IndicatorPattern::kSlower:
      return {{}, kSlowerSteps};
    case IndicatorPattern::kLost:
      return {{}, kLostSteps};
    case IndicatorPattern::kStorageLow:
      return {{}, kStorageLowSteps};
    case IndicatorPattern::kWorking:
      return {{}, kWorkingSteps};
    case IndicatorPattern::kDone:
      return {kDoneSteps, {}};
    case IndicatorPattern::kFailed:
      return {kFailedStart, kFailedSteps};
  }
  return {kDarkForEver, {}};
}

IndicatorLevels levels_at(IndicatorPattern pattern, nanoseconds elapsed) {
  return place_at(steps_of(pattern), elapsed).step->levels;
}

std::optional<nanoseconds> next_change(IndicatorPattern pattern, nanoseconds elapsed) {
  const PatternSteps steps = steps_of(pattern);
  const Place place = place_at(steps, elapsed);
  const bool is_last = steps.repeated.empty() && place.step == &steps.once.back();
  return is_last ? std::nullopt : std::optional(place.end);
}

}  // namespace trigmesh
