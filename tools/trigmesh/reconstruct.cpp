#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/photos/photo_input.hpp"
#include "firmware/photos/video_input.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/reconstruct_run.hpp"
#include "tools/trigmesh/scale_arguments.hpp"
#include "tools/trigmesh/surface_arguments.hpp"

namespace trigmesh {

namespace {

constexpr const char* kFooter = R"(Examples:
  trigmesh reconstruct photos --output model
  trigmesh reconstruct photos --output model --camera rig.toml
  trigmesh reconstruct recording --output model --match sequential --threads 2
  trigmesh reconstruct clip.mp4 --output model
  trigmesh reconstruct photos --output model --preset preview
  trigmesh reconstruct photos --output model --marker-side 100mm --up card
  trigmesh reconstruct list.txt --output model --stop-after sparse --memory-limit 500M

INPUT is a folder of JPEG or PNG photographs, a text file with one path a line, a recording (a folder with images/ and,
if there is one, timestamps.csv), or a video file, whose frames the program ffmpeg (Debian package ffmpeg) writes to
OUTPUT/frames. Of a video or recording with 10 frames a second or more only keyframes are used: the sharpest frame of
each stretch with enough motion; the report says of each frame why. The result is OUTPUT/model:
sparse/ (COLMAP text), projections.txt, sparse.ply, dense.ply, masks/ (where something moved), mesh.ply, textured.glb,
textured.obj, report.json and report.html.
With --marker-side or --known-distance lengths are metres when ArUco markers in the scene are seen well enough and
agree; else everything is made in a unit of its own, and the exit code is 4. When interrupted, the same command goes on
where it stopped.
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
    TM_ASSIGN_OR_RETURN(options.cameras, read_cameras(arguments.camera_file));
  }
  if (!arguments.poses.empty()) {
    TM_ASSIGN_OR_RETURN(options.poses, read_model(arguments.poses));
  }
  return options;
}

Result<PhotoSet> open_input(const ReconstructArguments& arguments,
                            int num_threads,
                            ProgressListener& listener,
                            const std::stop_token& stop) {
  const MaskUse masks = arguments.no_masks ? MaskUse::kIgnore : MaskUse::kUse;
  if (is_video_input(arguments.input)) {
    return open_video(arguments.input, arguments.output, masks, num_threads, listener, stop);
  }
  return open_photos(arguments.input,
                     arguments.grouping == "folder" ? Subfolders::kInclude : Subfolders::kIgnore,
                     masks);
}

Result<> run(const ReconstructArguments& arguments) {
  TM_ASSIGN_OR_RETURN(const ReconstructionOptions options, options_from(arguments));
  const auto open = [&](ProgressListener& listener, const std::stop_token& stop) {
    return open_input(arguments, options.num_threads, listener, stop);
  };
  return run_reconstruction(
      {open, options, arguments.input, arguments.output, arguments.surface.quiet});
}

}  // namespace

void add_reconstruct_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand(
      "reconstruct",
      "Make camera poses, a coloured point cloud and a textured mesh from photographs");
  auto arguments = std::make_shared<ReconstructArguments>();
  command
      ->add_option(
          "INPUT", arguments->input, "Folder of photographs, list file, recording or video file")
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
      ->add_option(
          "--frames",
          arguments->frames,
          "Which frames of a video or recording are used; auto: the keyframes of a video; walk: "
          "all, which are "
          "the keyframes of a walk in their order")
      ->check(CLI::IsMember({"auto", "all", "keyframes", "walk"}))
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
