#pragma once

#include <span>
#include <string>
#include <vector>

#include "firmware/pipeline/report.hpp"

// What the report says in words of the unit of lengths. Sections are per component, main first;
// none: nobody knew a length.

namespace trigmesh {

/// Whether lengths of the main component are metres.
[[nodiscard]] bool is_metric(std::span<const ScaleSection> scale);

/// What unit lengths have, how well it is known, and where up comes from.
[[nodiscard]] std::string units_sentence(std::span<const ScaleSection> scale);

/// An error for known lengths that disagree, warnings for components without scale or without the
/// up that was asked for.
[[nodiscard]] std::vector<ReportNote> scale_notes(std::span<const ScaleSection> scale);

}  // namespace trigmesh
