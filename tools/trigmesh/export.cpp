// trigmesh export: hands a model to another program.

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>

#include <CLI/CLI.hpp>

#include "firmware/base/check.hpp"
#include "sfm/exchange/bundler.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "sfm/exchange/nerfstudio.hpp"
#include "sfm/exchange/openmvs.hpp"
#include "sfm/exchange/ply.hpp"
#include "tools/trigmesh/command.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter =
    R"(MODEL is a result of `trigmesh reconstruct`, its model folder, or a folder of COLMAP files.
PATH is a folder; it is made when missing, and gets
  colmap-binary  cameras.bin images.bin points3D.bin
  colmap-text    cameras.txt images.txt points3D.txt
  nerfstudio     transforms.json sparse_pc.ply
  openmvs        scene.mvs             (only cameras without lens distortion)
  bundler        bundle.out list.txt   (only one focal length and radial distortion)
The last three name the photographs: in DIR as seen from PATH, or in PATH/images.

Examples:
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

}  // namespace

void add_export_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("export", "Convert a model for another program");
  const auto options = std::make_shared<ExportOptions>();  // shared by the callback's copies
  command->add_option("MODEL", options->model, "The model to convert")->required();
  command->add_option("--format", options->format, "What to write")
      ->required()
      ->check(CLI::IsMember(formats()));
  command->add_option("--output", options->output, "Folder to write to")
      ->required()
      ->option_text("PATH");
  command->add_option("--images", options->images, "Folder of the photographs")->option_text("DIR");
  command->footer(kFooter);
  command->callback([options, &context] { finish_command(context, export_model(*options)); });
}

}  // namespace trigmesh
