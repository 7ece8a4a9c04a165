// trigmesh export: hands a model to another program, or a session of the rig to a stick.

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>

#include <unistd.h>

#include <CLI/CLI.hpp>

#include "firmware/base/check.hpp"
#include "firmware/control/control_json.hpp"
#include "firmware/control/control_parse.hpp"
#include "firmware/session/session_id.hpp"
#include "sfm/exchange/bundler.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "sfm/exchange/nerfstudio.hpp"
#include "sfm/exchange/openmvs.hpp"
#include "sfm/exchange/ply.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/rig_client.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter =
    R"(Two things can be exported.

A session of the rig, by its id, to a folder DEST, such as a mounted stick: a verified copy in DEST/ID, made by the
service, which must be able to write there; Ctrl-C ends the waiting, not the copy.

A model, to --output in a --format of another program. MODEL is a result of `trigmesh reconstruct`, its model folder, or a folder of COLMAP files.
PATH is a folder; it is made when missing, and gets
  colmap-binary  cameras.bin images.bin points3D.bin
  colmap-text    cameras.txt images.txt points3D.txt
  nerfstudio     transforms.json sparse_pc.ply
  openmvs        scene.mvs             (only cameras without lens distortion)
  bundler        bundle.out list.txt   (only one focal length and radial distortion)
The last three name the photographs: in DIR as seen from PATH, or in PATH/images.

Examples:
  trigmesh export 20261125T145054Z-3fa9c1 /media/stick
  trigmesh export out --format colmap-binary --output out/colmap
  trigmesh export out --format nerfstudio --output nerf --images photos
  trigmesh export out --format openmvs --output mvs --images photos
)";

using WriteExport = Result<> (*)(const Scene& scene,
                                 const fs::path& output,
                                 std::string_view images);

struct ExportOptions {
  std::string model;
  std::string format;
  std::string output;
  std::string images;
  std::string destination;
  RigArguments rig;
};

/// The folder of photographs as seen from the output folder.
Result<std::string> image_folder(const ExportOptions& options) {
  if (options.images.empty()) {
    return "images";
  }
  std::error_code error;
  if (!fs::is_directory(options.images, error)) {
    return fail(ErrorCode::kNotFound, "no folder of photographs at {}", options.images);
  }
  const fs::path relative = fs::relative(options.images, options.output, error);
  if (error || relative.empty()) {
    return fail(ErrorCode::kIo,
                "cannot tell how {} is reached from {}: {}",
                options.images,
                options.output,
                error.message());
  }
  return relative.generic_string();
}

Result<> export_nerfstudio(const Scene& scene, const fs::path& output, std::string_view images) {
  constexpr std::string_view kPlyName = "sparse_pc.ply";
  TM_ASSIGN_OR_RETURN(const std::string json, write_nerfstudio(scene, images, kPlyName));
  TM_RETURN_IF_ERROR(write_file_atomically(output / kPlyName, write_ply(colored_points(scene))));
  return write_file_atomically(output / "transforms.json", json);
}

Result<> export_openmvs(const Scene& scene, const fs::path& output, std::string_view images) {
  TM_ASSIGN_OR_RETURN(const std::string archive, write_openmvs(scene, images));
  return write_file_atomically(output / "scene.mvs", archive);
}

Result<> export_bundler(const Scene& scene, const fs::path& output, std::string_view images) {
  TM_ASSIGN_OR_RETURN(const BundlerText text, write_bundler(scene, images));
  TM_RETURN_IF_ERROR(write_file_atomically(output / "list.txt", text.list));
  return write_file_atomically(output / "bundle.out", text.bundle);
}

/// The formats by the name that the user gives.
const std::map<std::string, WriteExport>& formats() {
  static const std::map<std::string, WriteExport> table{
      {"colmap-binary",
       [](const Scene& scene, const fs::path& output, std::string_view /*images*/) {
         return write_binary_model(scene, output);
       }},
      {"colmap-text",
       [](const Scene& scene, const fs::path& output, std::string_view /*images*/) {
         return write_text_model(scene, output);
       }},
      {"nerfstudio", export_nerfstudio},
      {"openmvs", export_openmvs},
      {"bundler", export_bundler}};
  return table;
}

Result<> export_model(const ExportOptions& options) {
  TM_ASSIGN_OR_RETURN(const Scene scene, read_model(options.model));
  TM_RETURN_IF_ERROR(make_directory(options.output));
  TM_ASSIGN_OR_RETURN(const std::string images, image_folder(options));
  TM_RETURN_IF_ERROR(formats().at(options.format)(scene, options.output, images));
  fmt::print("exported {} images and {} points to {}\n",
             scene.registered_count(),
             scene.landmarks.size(),
             options.output);
  return {};
}

/// Shows how far the copy is, on a terminal, until it is stopped.
void show_progress(const ControlClient& client, std::uint64_t after, const std::stop_token& stop) {
  const auto show = [](const ControlEvent& event) {
    if (event.kind != kExportEvent) {
      return true;
    }
    if (const auto copied = parse_export_event(event.data)) {
      fmt::print(stderr,
                 "\r\033[K{} of {}",
                 size_text(copied->copied_bytes),
                 size_text(copied->all_bytes));
    }
    return true;
  };
  (void)client.watch(after, show, stop);  // only for show
  fmt::print(stderr, "\r\033[K");
}

Result<ExportReport> ask_for_copy(const ControlClient& client, const ExportOptions& options) {
  const fs::path destination = fs::absolute(options.destination).lexically_normal();
  return client
      .post_and_wait(fmt::format("/v1/sessions/{}/export", options.model),
                     render_export_request(destination))
      .and_then(parse_export);
}

Result<> export_session(const ExportOptions& options) {
  const ControlClient client = options.rig.client();
  TM_ASSIGN_OR_RETURN(const ControlStatus status, ask_status(client));
  std::jthread progress;
  if (::isatty(STDERR_FILENO) != 0) {
    progress = std::jthread([&client, after = status.last_event](const std::stop_token& stop) {
      show_progress(client, after, stop);
    });
  }
  const auto report = ask_for_copy(client, options);
  if (progress.joinable()) {
    progress.request_stop();
    progress.join();
  }
  return report.map([&](const ExportReport& copy) {
    fmt::print("copied {} files, {}, to {}; each was read back and compared\n",
               copy.file_count,
               size_text(copy.size_bytes),
               copy.folder.string());
  });
}

/// The id of a session goes to the service, anything that exists is a model here.
Result<> run(const ExportOptions& options) {
  std::error_code ignored;  // what cannot be looked at is no model
  const bool is_session = is_session_id(options.model) && !fs::exists(options.model, ignored);
  const bool for_program = !options.format.empty() || !options.output.empty();
  if (is_session && !options.destination.empty() && !for_program) {
    return export_session(options);
  }
  if (!is_session && options.destination.empty() && !options.format.empty() &&
      !options.output.empty()) {
    return export_model(options);
  }
  return is_session ? fail(ErrorCode::kInvalidArgument,
                           "{} is a session of the rig: name the folder to copy it to, without "
                           "--format and --output",
                           options.model)
                    : fail(ErrorCode::kInvalidArgument,
                           "{} is a model, not the id of a session: give --format and --output, "
                           "and no further folder",
                           options.model);
}

}  // namespace

void add_export_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand(
      "export", "Convert a model for another program, or copy a session of the rig to a stick");
  const auto options = std::make_shared<ExportOptions>();  // shared by the callback's copies
  command->add_option("MODEL", options->model, "The model to convert, or the id of a session")
      ->required();
  command->add_option("DEST", options->destination, "Folder to copy the session to");
  command->add_option("--format", options->format, "What to write")
      ->check(CLI::IsMember(formats()));
  command->add_option("--output", options->output, "Folder to write to")->option_text("PATH");
  command->add_option("--images", options->images, "Folder of the photographs")->option_text("DIR");
  add_socket_option(*command, options->rig);
  command->footer(kFooter);
  command->callback([options, &context] { finish_command(context, run(*options)); });
}

}  // namespace trigmesh
