#include "firmware/pipeline/report_scale.hpp"

#include <fmt/format.h>

namespace trigmesh {
namespace {

constexpr double kPercent = 100.0;

}  // namespace

bool is_metric(std::span<const ScaleSection> scale) {
  return !scale.empty() && scale.front().outcome == ScaleOutcome::kOk;
}

std::string units_sentence(std::span<const ScaleSection> scale) {
  if (scale.empty()) {
    return "Up to scale: lengths are in model units, because no metric reference was given. Ratios "
           "and angles are valid.";
  }
  if (!is_metric(scale)) {
    return fmt::format(
        "Up to scale: lengths are in model units, because {}. Ratios and angles are valid.",
        scale.front().outcome == ScaleOutcome::kDisagreement ? "known lengths contradict each other"
                                                             : "no known length could be measured");
  }
  const ScaleSection& main = scale.front();
  const std::string up =
      main.z_is_up
          ? fmt::format("z is up, off the card (standard deviation {:.2f} degrees)", main.up_sd_deg)
          : "the axes are those that mapping chose";
  return fmt::format("Metric: lengths are in metres with a standard deviation of {:.2f} %; {}.",
                     kPercent * main.sd_ratio,
                     up);
}

std::vector<ReportNote> scale_notes(std::span<const ScaleSection> scale) {
  std::vector<ReportNote> notes;
  for (std::size_t c = 0; c < scale.size(); ++c) {
    const std::string which =
        scale.size() > 1 ? fmt::format("model {}", c + 1) : std::string("the model");
    if (!scale[c].problem.empty()) {
      notes.push_back({scale[c].outcome == ScaleOutcome::kDisagreement ? NoteSeverity::kError
                                                                       : NoteSeverity::kWarning,
                       fmt::format("{} has no scale: {}", which, scale[c].problem)});
    }
    if (!scale[c].up_problem.empty()) {
      notes.push_back({NoteSeverity::kWarning,
                       fmt::format("{} has no known up: {}", which, scale[c].up_problem)});
    }
  }
  return notes;
}

}  // namespace trigmesh
