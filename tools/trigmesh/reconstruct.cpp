#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/photos/photo_input.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "sfm/exchange/camera_profile.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/interrupt.hpp"
#include "tools/trigmesh/progress_printer.hpp"
#include "tools/trigmesh/scale_arguments.hpp"
#include "tools/trigmesh/surface_arguments.hpp"

namespace trigmesh {

namespace {

constexpr const char* kFooter = R"(Examples:
  trigmesh reconstruct photos --output model
  trigmesh reconstruct photos --output model --camera rig.toml
  trigmesh reconstruct recording --output model --match sequential --threads 2
  trigmesh reconstruct video --output model --frames keyframes
  trigmesh reconstruct photos --output model --preset preview
  trigmesh reconstruct photos --output model --marker-side 100mm --up card
  trigmesh reconstruct list.txt --output model --stop-after sparse --memory-limit 500M

INPUT is a folder of JPEG or PNG photographs, a text file with one path a line, or a recording (a folder with
images/ and, if there is one, timestamps.csv). Of a recording with 10 frames a second or more only keyframes are used:
the sharpest frame of each stretch with enough motion; the report says of each frame why. The result is OUTPUT/model:
sparse/ (COLMAP text), projections.txt, sparse.ply, dense.ply, mesh.ply, textured.glb, textured.obj, report.json and
report.html.
With --marker-side or --known-distance lengths are metres when ArUco markers in the scene are seen well enough and
agree; else everything is made in a unit of its own, and the exit code is 4. When interrupted, the same command goes on where
it stopped.
)";

/// The options as they come from the command line.
struct ReconstructArguments {
  std::string input;
  std::string output;
  std::string camera_file;
  std::string grouping = "auto";
  std::string features = "sift";
  std::string match = "auto";
  std::string frames = "auto";
  std::string stop_after = "texture";
  std::string poses;
  int max_features = FeatureOptions{}.max_keypoints;
  bool upright = false;
  bool no_upsample = false;
  bool no_masks = false;
  ScaleArguments scale;
  SurfaceArguments surface;
};

Result<ReconstructionOptions> options_from(const ReconstructArguments& arguments) {
  ReconstructionOptions options;
  options.feature_kind =
      *feature_kind_from_string(arguments.features);  // CLI11 has checked the names
  options.frames = *frame_use_from_string(arguments.frames);
  options.pair_mode = *pair_mode_from_string(arguments.match);
  options.grouping = *grouping_mode_from_string(arguments.grouping);
  options.features.max_keypoints = arguments.max_features;
  options.features.oriented = !arguments.upright;
  options.features.upsample = !arguments.no_upsample;
  options.num_threads = threads_from(arguments.surface);
  options.memory_limit_bytes = arguments.surface.memory_limit_bytes;
  options.seed = arguments.surface.seed;
  options.build =
      build_options_from(arguments.surface, *last_stage_from_string(arguments.stop_after));
  TM_ASSIGN_OR_RETURN(options.scale, scale_options_from(arguments.scale));
  options.software_version = TRIGMESH_VERSION;
  if (!arguments.camera_file.empty()) {
    TM_ASSIGN_OR_RETURN(const std::vector<CameraProfile> profiles,
                        read_camera_file(arguments.camera_file));
    for (const CameraProfile& profile : profiles) {
      options.cameras.push_back(profile.camera);
    }
  }
  if (!arguments.poses.empty()) {
    TM_ASSIGN_OR_RETURN(options.poses, read_model(arguments.poses));
  }
  return options;
}

void print_summary(const ReconstructionReport& report, const std::string& output) {
  fmt::print("{}\n", report.verdict_sentence);
  if (!report.scale.empty()) {
    fmt::print("{}\n", report.units_sentence);
  }
  for (const ImageReport& image : report.images) {
    if (image.reason != RefusalReason::kNone) {
      fmt::print("  refused {}: {} - {}\n", image.name, to_string(image.reason), image.detail);
    }
  }
  for (const ReportNote& note : report.notes) {
    fmt::print("  {}: {}\n", to_string(note.severity), note.text);
  }
  fmt::print(
      "{} points, mean reprojection error {:.2f} px\nresult in {}/model, open "
      "{}/model/report.html\n",
      report.overall.points,
      report.overall.mean_error_px,
      output,
      output);
}

/// Who gave a length wants metres.
Result<> check_scale(const ReconstructionReport& report, const std::string& output) {
  if (report.scale.empty() || report.metres_per_unit) {
    return {};
  }
  return fail(ErrorCode::kInsufficientData,
              "the model in {}/model has no scale, its lengths are in a unit of their own: {}",
              output,
              report.scale.front().problem);
}

Result<> run(const ReconstructArguments& arguments) {
  TM_ASSIGN_OR_RETURN(const ReconstructionOptions options, options_from(arguments));
  TM_ASSIGN_OR_RETURN(
      const PhotoSet photos,
      open_photos(arguments.input,
                  arguments.grouping == "folder" ? Subfolders::kInclude : Subfolders::kIgnore,
                  arguments.no_masks ? MaskUse::kIgnore : MaskUse::kUse));
  const SteadyClock clock;
  const InterruptWatch interrupt;
  std::optional<ReconstructionSummary> summary;
  {
    ProgressPrinter printer(arguments.surface.quiet ? ProgressPrinter::Style::kQuiet
                                                    : ProgressPrinter::style_of_stderr(),
                            clock);
    TM_ASSIGN_OR_RETURN(
        summary, reconstruct(photos, arguments.output, options, clock, printer, interrupt.token()));
  }
  print_summary(summary->report, arguments.output);
  if (summary->report.components.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "no model could be made from {}; {}/model/report.html tells why for each "
                "photograph and what to do",
                arguments.input,
                arguments.output);
  }
  return check_scale(summary->report, arguments.output);
}

}  // namespace

void add_reconstruct_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand(
      "reconstruct",
      "Make camera poses, a coloured point cloud and a textured mesh from photographs");
  auto arguments = std::make_shared<ReconstructArguments>();
  command->add_option("INPUT", arguments->input, "Folder of photographs, list file or recording")
      ->required();
  command->add_option("-o,--output", arguments->output, "Folder for the result; made when missing")
      ->required();
  CLI::Option* camera = command->add_option(
      "--camera",
      arguments->camera_file,
      "Known intrinsics: a profile of trigmesh calibrate or a COLMAP cameras.txt; "
      "else the focal length in EXIF "
      "is a first guess, else it is solved");
  command
      ->add_option("--camera-groups",
                   arguments->grouping,
                   "Which photographs share a camera: by EXIF and size, all, by subfolder, none")
      ->check(CLI::IsMember({"auto", "single", "folder", "image"}))
      ->capture_default_str();
  command->add_option("--features", arguments->features, "Kind of features")
      ->check(CLI::IsMember({"sift", "surf", "akaze", "orb"}))
      ->capture_default_str();
  command
      ->add_option("--max-features", arguments->max_features, "Most features kept per photograph")
      ->check(CLI::Range(16, 100000))
      ->capture_default_str();
  command->add_flag(
      "--upright", arguments->upright, "The camera was never rolled: features need no orientation");
  command->add_flag("--no-upsample",
                    arguments->no_upsample,
                    "Do not look for features at twice the image size (SIFT, SURF): twice as fast, "
                    "poses somewhat less exact");
  command
      ->add_option("--frames",
                   arguments->frames,
                   "Which frames of a recording are used; auto: the keyframes of a video")
      ->check(CLI::IsMember({"auto", "all", "keyframes"}))
      ->capture_default_str();
  command->add_option("--match", arguments->match, "Which photographs are compared")
      ->check(CLI::IsMember({"auto", "sequential", "retrieval", "exhaustive"}))
      ->capture_default_str();
  command
      ->add_option(
          "--poses",
          arguments->poses,
          "Known cameras and poses, a COLMAP model with the names of the photographs: only "
          "points and surface are made")
      ->excludes(camera);
  command->add_flag("--no-masks",
                    arguments->no_masks,
                    "Do not use masks/NAME.png beside the photographs (white = leave out)");
  command->add_option("--stop-after", arguments->stop_after, "Last stage")
      ->check(CLI::IsMember({"sparse", "dense", "mesh", "texture"}))
      ->capture_default_str();
  add_scale_options(*command, arguments->scale);
  add_surface_options(*command, arguments->surface);
  command->footer(kFooter);
  command->callback([arguments, &context] { finish_command(context, run(*arguments)); });
}

}  // namespace trigmesh
