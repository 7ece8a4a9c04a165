#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/report.hpp"

namespace trigmesh {

/// What a report tells of the stages up to mapping: what a scene alone does not know.
struct ReportHistory {
  std::vector<ImageOutcome> images;
  std::vector<VideoFrameSection> frames;             ///< of the video, if it was one
  std::vector<PairEvidence> pairs;                   ///< positions are < images.size()
  std::vector<IntrinsicsOrigin> intrinsics_origins;  ///< per camera group; kSolved where untold
  std::vector<ScaleSection> scale;                   ///< per component; empty: nobody knew a length
  std::vector<ReportSetting> settings;
  std::optional<FinishSection> finish;  ///< of the surface, if there was one
  std::string input_description;
};

/// Reads it from the text of render_report_json. kCorruptData, with the member and the reason:
/// not JSON, another schema, a member that is missing, of another type or out of its list.
[[nodiscard]] Result<ReportHistory> parse_report_history(std::string_view json);

}  // namespace trigmesh
