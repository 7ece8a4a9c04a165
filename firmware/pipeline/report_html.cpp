#include "firmware/pipeline/report_html.hpp"

#include <string_view>

#include "firmware/pipeline/report_geometry.hpp"
#include "firmware/pipeline/report_json.hpp"
#include "firmware/pipeline/report_page.hpp"

namespace trigmesh {
namespace {

/// Adds a data block that the browser does not run. In JSON the three characters that mean
/// something to an HTML parser occur only inside of strings, where an escape says the same: no name
/// can end the block or open a comment.
void append_data(std::string& html, std::string_view id, std::string_view json) {
  html += R"(<script type="application/json" id=")";
  html += id;
  html += "\">";
  for (const char c : json) {
    switch (c) {
      case '<':
        html += "\\u003c";
        break;
      case '>':
        html += "\\u003e";
        break;
      case '&':
        html += "\\u0026";
        break;
      default:
        html += c;
    }
  }
  html += "</script>\n";
}

}  // namespace

std::string render_report_html(const ReconstructionReport& report,
                               std::span<const Scene> components) {
  std::string html;
  for (const std::string_view piece : report_page_head()) {
    html += piece;
  }
  append_data(html, "report-data", render_report_json(report));
  append_data(
      html, "geometry-data", render_report_geometry(report, components, kReportPagePointLimit));
  for (const std::string_view piece : report_page_tail()) {
    html += piece;
  }
  return html;
}

}  // namespace trigmesh
