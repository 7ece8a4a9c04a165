#pragma once

#include <cstddef>
#include <string>

#include "firmware/pipeline/report.hpp"

namespace trigmesh {

/// Version of the members of report.json.
inline constexpr std::size_t kReportSchema = 1;

/// The report as JSON text (UTF-8, indented by two spaces, final newline); schema in README.md,
/// member "schema" = 1. Numbers are rounded (pixels 1e-4, degrees 1e-3, ratios 1e-3, distortion
/// 1e-8); the same report gives the same bytes. Bytes in names that are not UTF-8 become U+FFFD.
[[nodiscard]] std::string render_report_json(const ReconstructionReport& report);

}  // namespace trigmesh
