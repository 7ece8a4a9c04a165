#include "firmware/pipeline/report_html.hpp"

#include <algorithm>
#include <string_view>

#include <nlohmann/json.hpp>

#include "firmware/pipeline/base64.hpp"
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

using Json = nlohmann::ordered_json;

std::string to_text(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// {"name", "bytes", "limit_bytes", "glb": base64, or null when it is too large}
std::string model_json(const ReportAttachments& attachments) {
  const std::string_view glb = attachments.glb;
  Json carried = nullptr;
  if (glb.size() <= kReportPageGlbLimitBytes) {
    carried = base64({reinterpret_cast<const std::uint8_t*>(glb.data()), glb.size()});
  }
  return to_text({{"name", std::string(attachments.glb_name)},
                  {"bytes", glb.size()},
                  {"limit_bytes", kReportPageGlbLimitBytes},
                  {"glb", std::move(carried)}});
}

/// [{"image": row of report.images, "near", "far", "filled_ratio", "picture", "depth",
/// "confidence": base64 of JPEG}]; pictures of images that are not in the report are left out.
std::string depth_json(const ReconstructionReport& report, std::span<const DepthPicture> pictures) {
  Json list = Json::array();
  for (const DepthPicture& picture :
       pictures.first(std::min(pictures.size(), kReportDepthViewLimit))) {
    const auto row = std::ranges::find(report.images, picture.image_name, &ImageReport::name);
    if (row == report.images.end()) {
      continue;
    }
    list.push_back({{"image", row - report.images.begin()},
                    {"near", picture.near_depth},
                    {"far", picture.far_depth},
                    {"filled_ratio", picture.filled_ratio},
                    {"picture", base64(picture.image_jpeg)},
                    {"depth", base64(picture.depth_jpeg)},
                    {"confidence", base64(picture.confidence_jpeg)}});
  }
  return to_text(list);
}

}  // namespace

std::string render_report_html(const ReconstructionReport& report,
                               std::span<const Scene> components,
                               const ReportAttachments& attachments) {
  std::string html;
  for (const std::string_view piece : report_page_head()) {
    html += piece;
  }
  append_data(html, "report-data", render_report_json(report));
  append_data(
      html, "geometry-data", render_report_geometry(report, components, kReportPagePointLimit));
  if (!attachments.glb.empty()) {
    append_data(html, "model-data", model_json(attachments));
  }
  if (!attachments.depth_pictures.empty()) {
    append_data(html, "depth-data", depth_json(report, attachments.depth_pictures));
  }
  for (const std::string_view piece : report_page_tail()) {
    html += piece;
  }
  return html;
}

}  // namespace trigmesh
