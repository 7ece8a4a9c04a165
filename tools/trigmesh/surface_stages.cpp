// trigmesh densify, mesh, texture: the stages after mapping on a model that exists.

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/photos/photo_input.hpp"
#include "firmware/pipeline/existing_model.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/interrupt.hpp"
#include "tools/trigmesh/progress_printer.hpp"
#include "tools/trigmesh/surface_arguments.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter =
    R"(DIR is a result of `trigmesh reconstruct` or a COLMAP workspace (sparse/ and images/). The photographs are
looked for in --images, else in DIR/images. The result is OUTPUT/model, by default in DIR. Finished stages in
OUTPUT/work are not done again.

Examples:
  trigmesh densify out --images photos
  trigmesh mesh out --images photos --preset preview
  trigmesh texture colmap_workspace --output out --memory-limit 1500M
)";

struct StageArguments {
  std::string model;
  std::string images;
  std::string output;
  bool no_masks = false;
  SurfaceArguments surface;
};

/// Where the photographs are: --images, or the model's own folder when it has images/ (with masks/
/// beside).
Result<std::string> photo_folder(const StageArguments& arguments) {
  if (!arguments.images.empty()) {
    return arguments.images;
  }
  std::error_code error;
  if (!fs::is_directory(fs::path(arguments.model) / "images", error)) {
    return fail(ErrorCode::kNotFound,
                "no photographs at {}/images: name their folder with --images",
                arguments.model);
  }
  return arguments.model;
}

void print_files(const std::string& output) {
  for (const char* name : {"dense.ply", "mesh.ply", "textured.glb", "textured.obj"}) {
    const fs::path file = fs::path(output) / "model" / name;
    std::error_code error;
    if (fs::exists(file, error)) {
      fmt::print("{}\n", file.string());
    }
  }
}

Result<> run(const StageArguments& arguments, LastStage last) {
  const std::string output = arguments.output.empty() ? arguments.model : arguments.output;
  TM_ASSIGN_OR_RETURN(const ExistingModel model, open_existing_model(arguments.model));
  TM_ASSIGN_OR_RETURN(const std::string folder, photo_folder(arguments));
  TM_ASSIGN_OR_RETURN(
      const PhotoSet photos,
      open_photos(
          folder, Subfolders::kInclude, arguments.no_masks ? MaskUse::kIgnore : MaskUse::kUse));
  ReconstructionOptions options;
  options.num_threads = threads_from(arguments.surface);
  options.memory_limit_bytes = arguments.surface.memory_limit_bytes;
  options.seed = arguments.surface.seed;
  options.software_version = TRIGMESH_VERSION;
  options.build = build_options_from(arguments.surface, last);
  const SteadyClock clock;
  const InterruptWatch interrupt;
  std::vector<ReportNote> notes;
  {
    ProgressPrinter printer(arguments.surface.quiet ? ProgressPrinter::Style::kQuiet
                                                    : ProgressPrinter::style_of_stderr(),
                            clock);
    TM_ASSIGN_OR_RETURN(
        const ReconstructionSummary summary,
        continue_model(model, photos, output, options, clock, printer, interrupt.token()));
    notes = summary.report.notes;
  }
  for (const ReportNote& note : notes) {
    fmt::print("  {}: {}\n", to_string(note.severity), note.text);
  }
  print_files(output);
  return {};
}

void add_stage_command(CLI::App& app,
                       CommandContext& context,
                       LastStage last,
                       const std::string& name,
                       const std::string& what) {
  CLI::App* command = app.add_subcommand(name, what);
  const auto arguments = std::make_shared<StageArguments>();  // shared by the callback's copies
  command->add_option("DIR", arguments->model, "The model to work on")->required();
  command->add_option("--images", arguments->images, "Folder of the photographs");
  command->add_option(
      "-o,--output", arguments->output, "Folder for the result; made when missing. Default: DIR");
  command->add_flag("--no-masks",
                    arguments->no_masks,
                    "Do not use masks/NAME.png beside the photographs (white = leave out)");
  add_surface_options(*command, arguments->surface);
  command->footer(kFooter);
  command->callback(
      [arguments, last, &context] { finish_command(context, run(*arguments, last)); });
}

}  // namespace

void add_surface_commands(CLI::App& app, CommandContext& context) {
  add_stage_command(
      app, context, LastStage::kDense, "densify", "Make depth maps and a dense cloud of a model");
  add_stage_command(app, context, LastStage::kMesh, "mesh", "Make the surface of a model");
  add_stage_command(
      app, context, LastStage::kTexture, "texture", "Make the textured surface of a model");
}

}  // namespace trigmesh
