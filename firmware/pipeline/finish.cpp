#include "firmware/pipeline/finish.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace trigmesh {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kMostGapRatio = 0.04;
constexpr double kMostOfOneGap = 0.02;
// Smaller ones are left untold.
constexpr double kLeastToldRatio = 0.003;
constexpr std::size_t kMostTold = 5;
// Nearer than this is "from about there".
constexpr double kSamePlaceDeg = 10.0;
// Above this a turn to the side means little.
constexpr double kFromAboveDeg = 65.0;

double to_nearest_5(double degrees) {
  return 5.0 * std::round(std::abs(degrees) / 5.0);
}

/// Where to stand, beginning with "from".
std::string place_in_words(const FinishGap& gap, double elevation_deg) {
  if (elevation_deg >= kFromAboveDeg && gap.rise_deg >= kSamePlaceDeg) {
    return fmt::format("from steeply above, about {:.0f}\u00b0 higher than in {}",
                       to_nearest_5(gap.rise_deg),
                       gap.photograph);
  }
  const bool turns = std::abs(gap.turn_left_deg) >= kSamePlaceDeg;
  const bool rises = std::abs(gap.rise_deg) >= kSamePlaceDeg;
  if (!turns && !rises) {
    return fmt::format("from about where {} was taken, and a step to either side of it",
                       gap.photograph);
  }
  std::string words = fmt::format("from where {} was taken", gap.photograph);
  if (turns) {
    words += fmt::format(" go about {:.0f}\u00b0 to the {} around it",
                         to_nearest_5(gap.turn_left_deg),
                         gap.turn_left_deg > 0.0 ? "left" : "right");
  }
  if (rises) {
    words += fmt::format("{} hold the camera {}, by about {:.0f}\u00b0",
                         turns ? " and" : "",
                         gap.rise_deg > 0.0 ? "higher" : "lower",
                         to_nearest_5(gap.rise_deg));
  }
  return words;
}

FinishGap told(const ReachableGap& gap, std::span<const DenseView> views) {
  FinishGap result;
  result.kind = gap.kind;
  result.center_in_world = gap.center_in_world;
  result.area_ratio = gap.area_ratio;
  result.photograph = views[gap.direction.view].name;
  result.turn_left_deg = gap.direction.turn_left_rad * kDegPerRad;
  result.rise_deg = gap.direction.rise_rad * kDegPerRad;
  result.advice = fmt::format("{}, {:.1f} % of the surface: {}",
                              gap.kind == GapKind::kHole ? "a hole" : "seen too little",
                              100.0 * gap.area_ratio,
                              place_in_words(result, gap.direction.elevation_rad * kDegPerRad));
  return result;
}

std::string sentence_for(const FinishSection& finish, Verdict registration, double largest) {
  if (registration == Verdict::kNotReady) {
    return "Not ready: most photographs are not part of the model.";
  }
  if (finish.ready) {
    return finish.gap_ratio < kLeastToldRatio
               ? "Ready: the surface is closed and well seen wherever a photograph can reach it."
               : fmt::format(
                     "Ready: what is open or seen too little comes to {:.1f} % of the surface.",
                     100.0 * finish.gap_ratio);
  }
  return fmt::format(
      "Not ready: {:.1f} % of the surface is open or seen too little, the largest place of it "
      "{:.1f} %.",
      100.0 * finish.gap_ratio,
      100.0 * largest);
}

}  // namespace

FinishSection judge_finish(const SurfaceCoverage& coverage,
                           std::span<const DenseView> views,
                           Verdict registration) {
  FinishSection finish;
  finish.gap_ratio = coverage.gap_ratio;
  const double largest = coverage.gaps.empty() ? 0.0 : coverage.gaps.front().area_ratio;
  finish.ready = registration != Verdict::kNotReady && coverage.gap_ratio <= kMostGapRatio &&
                 largest <= kMostOfOneGap;
  finish.sentence = sentence_for(finish, registration, largest);
  for (const ReachableGap& gap : coverage.gaps) {
    if (gap.area_ratio >= kLeastToldRatio && finish.gaps.size() < kMostTold) {
      finish.gaps.push_back(told(gap, views));
    }
  }
  return finish;
}

}  // namespace trigmesh
