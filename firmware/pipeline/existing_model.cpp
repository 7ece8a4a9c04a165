#include "firmware/pipeline/existing_model.hpp"

#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/pipeline/model_writer.hpp"
#include "sfm/exchange/model_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxReportBytes = std::size_t{256} << 20U;

bool file_exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

/// The folder that holds sparse/ and report.json in a result of ours: `path` itself or its model/.
fs::path model_folder_of(const fs::path& path) {
  return file_exists(path / "model" / "sparse") ? path / "model" : path;
}

ReportHistory history_of_scenes(const std::vector<Scene>& components) {
  ReportHistory history;
  history.intrinsics_origins.assign(components.front().cameras.size(), IntrinsicsOrigin::kGiven);
  for (const View& view : components.front().views) {
    ImageOutcome outcome;
    outcome.name = view.name;
    outcome.features = view.keypoints_px.size();
    outcome.reason = view.cam_from_world ? RefusalReason::kNone : RefusalReason::kNoGivenPose;
    history.images.push_back(std::move(outcome));
  }
  return history;
}

/// The report must speak of these scenes: each image with a pose is registered in it.
Result<> check_same_scenes(const ReportHistory& history, const std::vector<Scene>& components) {
  std::set<std::string_view> told;
  for (const ImageOutcome& image : history.images) {
    told.insert(image.name);
  }
  for (const Scene& scene : components) {
    for (const View& view : scene.views) {
      if (view.cam_from_world && !told.contains(view.name)) {
        return fail(ErrorCode::kCorruptData, "it does not know the image {}", view.name);
      }
    }
  }
  if (!history.scale.empty() && history.scale.size() != components.size()) {
    return fail(ErrorCode::kCorruptData,
                "it tells the scale of {} models, there are {}",
                history.scale.size(),
                components.size());
  }
  return {};
}

Result<ReportHistory> read_history(const fs::path& file, const std::vector<Scene>& components) {
  TM_ASSIGN_OR_RETURN(const std::string text, read_file(file, kMaxReportBytes));
  TM_ASSIGN_OR_RETURN(ReportHistory history, parse_report_history(text));
  TM_RETURN_IF_ERROR(check_same_scenes(history, components));
  return history;
}

}  // namespace

Result<ExistingModel> open_existing_model(const fs::path& path) {
  ExistingModel model;
  TM_ASSIGN_OR_RETURN(Scene main, read_model(path));
  model.components.push_back(std::move(main));
  const fs::path folder = model_folder_of(path);
  for (std::size_t i = 1; file_exists(component_folder(folder, i)); ++i) {
    TM_ASSIGN_OR_RETURN(Scene part, read_model(component_folder(folder, i)));
    model.components.push_back(std::move(part));
  }
  if (file_exists(folder / "report.json")) {
    auto history = read_history(folder / "report.json", model.components);
    if (history) {
      model.history = std::move(*history);
      return model;
    }
    model.warning = fmt::format("what {} says of refused images and matches was not taken over: {}",
                                (folder / "report.json").filename().string(),
                                history.error().message);
  }
  model.history = history_of_scenes(model.components);
  return model;
}

}  // namespace trigmesh
