#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "firmware/pipeline/report.hpp"
#include "firmware/pipeline/report_pictures.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// Most 3D points that a report page carries; beyond it every component is thinned evenly, and the
/// page says so.
inline constexpr std::size_t kReportPagePointLimit = 200'000;

/// Largest GLB that a page carries; a larger one is named instead. In base64 it is a third longer,
/// and browsers on tablets open pages of some 50 MB.
inline constexpr std::size_t kReportPageGlbLimitBytes = std::size_t{24} << 20;

/// What the page carries and report.json does not. Borrowed for the call.
struct ReportAttachments {
  /// write_glb of the main component's mesh, textured or coloured; empty for none. Where it stands
  /// is read from its asset.extras.
  std::string_view glb;
  std::string_view glb_name = "textured.glb";    ///< the file beside the page
  std::span<const DepthPicture> depth_pictures;  ///< at most kReportDepthViewLimit are shown
};

/// One self-contained HTML page: it opens from a file, asks the network for nothing, and runs no
/// script but its own (Content-Security-Policy with the script's hash). `components` are those the
/// report was built from; views without a row in the report are not shown. Sections
/// without data are left out. Everything taken from the data is text to the page, never markup.
/// Same input, same bytes.
[[nodiscard]] std::string render_report_html(const ReconstructionReport& report,
                                             std::span<const Scene> components,
                                             const ReportAttachments& attachments = {});

}  // namespace trigmesh
