#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/report_history.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// A model on disk, to be continued.
struct ExistingModel {
  std::vector<Scene> components;  ///< main first, at least one
  /// From the report beside the model; else what the scenes tell: which images were refused and how
  /// they matched is not known then.
  ReportHistory history;
  std::string warning;  ///< why a report that is there could not be used, one sentence; or empty
};

/// Reads a result of ours with its parts and its report, or the model of another program (see
/// read_model). Errors of read_model; a report that cannot be read is a warning only.
[[nodiscard]] Result<ExistingModel> open_existing_model(const std::filesystem::path& path);

}  // namespace trigmesh
