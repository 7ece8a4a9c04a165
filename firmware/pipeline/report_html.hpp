#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "firmware/pipeline/report.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// Most 3D points that a report page carries; beyond it every component is thinned evenly, and the
/// page says so.
inline constexpr std::size_t kReportPagePointLimit = 200'000;

/// One self-contained HTML page: it opens from a file, asks the network for nothing, and runs no
/// script but its own (Content-Security-Policy with the script's hash). `components` are those the
/// report was built from; views without a row in the report are not shown. Everything taken from
/// the data is text to the page, never markup. Same input, same bytes.
[[nodiscard]] std::string render_report_html(const ReconstructionReport& report,
                                             std::span<const Scene> components);

}  // namespace trigmesh
