#pragma once

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/model_place.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "firmware/pipeline/report.hpp"
#include "firmware/pipeline/report_html.hpp"
#include "sfm/exchange/obj.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// Publishes a new model at its place: sparse/ (COLMAP text), projections.txt and sparse.ply of the
/// main model, for each further model component_N/ with the same files, report.json and
/// report.html. Before the step an older model stays as it is. Without any model only the reports
/// are written. kIo, kNoSpace.
[[nodiscard]] Result<> write_model(ModelPlace& place,
                                   std::span<const Scene> components,
                                   const ReconstructionReport& report);

/// Adds files to the model at its place, or replaces those of the same name, and renews the
/// reports, in one step: a reader sees the model as it was or with all of them. What else is in the
/// folder stays, but for older files of `renewed_folder`, when one is named: `files` have all that
/// belongs there. kIo, kNoSpace.
[[nodiscard]] Result<> extend_model(ModelPlace& place,
                                    std::span<const NamedFile> files,
                                    std::span<const Scene> components,
                                    const ReconstructionReport& report,
                                    const ReportAttachments& attachments = {},
                                    std::string_view renewed_folder = {});

/// Where part `index` of a model lies: the main one in `model` itself, the others below it.
[[nodiscard]] std::filesystem::path component_folder(const std::filesystem::path& model,
                                                     std::size_t index);

/// Writes a file of JSON: seconds and processor seconds per stage. Clock times live here and
/// nowhere else.
[[nodiscard]] Result<> write_timings(const std::filesystem::path& file,
                                     std::span<const StageTime> times);

}  // namespace trigmesh
