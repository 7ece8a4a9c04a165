#include "firmware/pipeline/model_writer.hpp"

#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/report_html.hpp"
#include "firmware/pipeline/report_json.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "sfm/exchange/ply.hpp"
#include "sfm/exchange/projections.hpp"

namespace trigmesh {

namespace {

Result<> write_component(const Scene& scene, const std::filesystem::path& folder) {
  TM_RETURN_IF_ERROR(write_text_model(scene, folder / "sparse"));
  TM_ASSIGN_OR_RETURN(const std::string projections, write_projections(scene));
  TM_RETURN_IF_ERROR(write_file_atomically(folder / "projections.txt", projections));
  return write_file_atomically(folder / "sparse.ply", write_ply(colored_points(scene)));
}

/// The folder in which a model is put together; it goes away unless it becomes the model.
class StagedFolder {
 public:
  explicit StagedFolder(std::filesystem::path path) : path_(std::move(path)) { remove(); }

  ~StagedFolder() { remove(); }

  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;
  StagedFolder(StagedFolder&&) = delete;
  StagedFolder& operator=(StagedFolder&&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  void remove() const {
    std::error_code ignored;  // a left-over is overwritten by the next run
    std::filesystem::remove_all(path_, ignored);
  }

  std::filesystem::path path_;
};

Result<> write_reports(const std::filesystem::path& folder,
                       std::span<const Scene> components,
                       const ReconstructionReport& report,
                       const ReportAttachments& attachments) {
  TM_RETURN_IF_ERROR(write_file_atomically(folder / "report.json", render_report_json(report)));
  return write_file_atomically(folder / "report.html",
                               render_report_html(report, components, attachments));
}

/// The same files again under another folder, as links where the file system can, else as copies.
Result<> link_tree(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(from, error)) {
    const std::filesystem::path target = to / entry.path().lexically_relative(from);
    if (entry.is_directory()) {
      TM_RETURN_IF_ERROR(make_directory(target));
      continue;
    }
    std::filesystem::create_hard_link(entry.path(), target, error);
    if (error) {
      std::filesystem::copy_file(entry.path(), target, error);
    }
    if (error) {
      return fail(error == std::errc::no_space_on_device ? ErrorCode::kNoSpace : ErrorCode::kIo,
                  "cannot take {} over into the new model: {}",
                  entry.path().string(),
                  error.message());
    }
  }
  if (error) {
    return fail(ErrorCode::kIo, "cannot list the model {}: {}", from.string(), error.message());
  }
  return {};
}

}  // namespace

Result<> ModelFolder::publish() {
  return replace_directory(staged(), model());
}

Result<> extend_model(ModelPlace& place,
                      std::span<const NamedFile> files,
                      std::span<const Scene> components,
                      const ReconstructionReport& report,
                      const ReportAttachments& attachments,
                      std::string_view renewed_folder) {
  const StagedFolder staged(place.staged());
  TM_RETURN_IF_ERROR(make_directory(staged.path()));
  TM_RETURN_IF_ERROR(link_tree(place.model(), staged.path()));
  if (!renewed_folder.empty()) {
    std::error_code ignored;  // a left-over is seen as such by its name
    std::filesystem::remove_all(staged.path() / renewed_folder, ignored);
  }
  // Files are replaced by rename, so the linked ones of the old model keep their bytes.
  for (const NamedFile& file : files) {
    TM_RETURN_IF_ERROR(make_directory((staged.path() / file.name).parent_path()));
    TM_RETURN_IF_ERROR(write_file_atomically(staged.path() / file.name, file.bytes));
  }
  TM_RETURN_IF_ERROR(write_reports(staged.path(), components, report, attachments));
  return place.publish();
}

Result<> write_model(ModelPlace& place,
                     std::span<const Scene> components,
                     const ReconstructionReport& report) {
  const StagedFolder staged(place.staged());
  TM_RETURN_IF_ERROR(make_directory(staged.path()));
  for (std::size_t i = 0; i < components.size(); ++i) {
    const std::filesystem::path folder = component_folder(staged.path(), i);
    TM_RETURN_IF_ERROR(make_directory(folder / "sparse"));
    TM_RETURN_IF_ERROR(write_component(components[i], folder));
  }
  TM_RETURN_IF_ERROR(write_reports(staged.path(), components, report, {}));
  return place.publish();
}

std::filesystem::path component_folder(const std::filesystem::path& model, std::size_t index) {
  return index == 0 ? model : model / fmt::format("component_{}", index + 1);
}

Result<> write_timings(const std::filesystem::path& file, std::span<const StageTime> times) {
  nlohmann::ordered_json json;
  const auto add = [&json](
                       const char* kind, std::string_view stage, std::chrono::nanoseconds time) {
    json[kind][std::string(stage)] = std::chrono::duration<double>(time).count();
  };
  StageTime total;
  for (const StageTime& time : times) {
    add("seconds", to_string(time.stage), time.duration);
    add("cpu_seconds", to_string(time.stage), time.cpu_time);
    total.duration += time.duration;
    total.cpu_time += time.cpu_time;
  }
  add("seconds", "total", total.duration);
  add("cpu_seconds", "total", total.cpu_time);
  return write_file_atomically(file, json.dump(2) + "\n");
}

}  // namespace trigmesh
