#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace trigmesh {

/// What the rig tells the operator.
enum class IndicatorPattern : std::uint8_t {
  kOff,         ///< no power, or no service
  kIdle,        ///< ready: a short blink every few seconds
  kCapturing,   ///< steady light
  kSlower,      ///< move slower: quick blinks, quick beeps
  kLost,        ///< go back to where it was seen last: long beeps
  kStorageLow,  ///< three blinks and a beep
  kWorking,     ///< slow, even blinking
  kDone,        ///< once: long light with two beeps, then off
  kFailed,      ///< blinks in pairs until someone looks, a long beep at first
};

inline constexpr std::size_t kPatternCount = 9;

/// "idle", "capturing", "slower", ...: stable.
[[nodiscard]] std::string_view to_string(IndicatorPattern pattern);

/// What shines and sounds.
struct IndicatorLevels {
  bool light = false;
  bool buzzer = false;

  bool operator==(const IndicatorLevels&) const = default;
};

/// A stretch of a pattern.
struct PatternStep {
  IndicatorLevels levels;
  std::chrono::milliseconds duration{0};  ///< > 0
};

/// A pattern as data: steps that are played once, then steps that are played over and over. When
/// there is nothing to repeat, the last levels stay.
struct PatternSteps {
  std::span<const PatternStep> once;
  std::span<const PatternStep> repeated;
};

/// The table of all patterns.
[[nodiscard]] PatternSteps steps_of(IndicatorPattern pattern);

/// What shines and sounds so long after the pattern began. Negative times count as 0.
[[nodiscard]] IndicatorLevels levels_at(IndicatorPattern pattern, std::chrono::nanoseconds elapsed);

/// When, since the pattern began, the step ends that holds at `elapsed`; nothing when it lasts for
/// ever.
[[nodiscard]] std::optional<std::chrono::nanoseconds> next_change(IndicatorPattern pattern,
                                                                  std::chrono::nanoseconds elapsed);

}  // namespace trigmesh
