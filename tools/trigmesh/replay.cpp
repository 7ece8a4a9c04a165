#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/photos/photo_input.hpp"
#include "firmware/photos/pressed_frames.hpp"
#include "firmware/photos/session_options.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/reconstruct_run.hpp"

namespace trigmesh {

namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter = R"(Examples:
  trigmesh replay 20261125T145054Z-3fa9c1 --output again
  trigmesh replay 20261125T145054Z-3fa9c1 --output again --verify
  trigmesh replay recording --output model --stop-after sparse
  trigmesh replay recording --output model --trigger hold --camera rig.toml

SESSION is a session of the rig: its kept frames, its settings and its camera profile give the same model again, byte for
byte, at any number of threads. Or a recording: a folder with images/ and timestamps.csv; frames are then chosen as the
rig would have chosen them, from the press in events.csv (if there is one) to its end.
)";

constexpr std::size_t kMaxComparedBytes = std::size_t{4} << 30U;

struct ReplayArguments {
  std::string session;
  std::string output;
  std::string camera_file;
  std::string trigger = "toggle";
  std::string stop_after = "texture";
  int threads = 0;
  bool quiet = false;
  bool verify = false;
};

/// What is replayed.
struct ReplayInput {
  PhotoSet recorded;  ///< `photos` read from it
  PhotoSet photos;
  ReconstructionOptions options;
};

Result<> apply(const ReplayArguments& arguments, ReconstructionOptions& options) {
  options.build.last_stage = *last_stage_from_string(arguments.stop_after);
  if (arguments.threads > 0) {
    options.num_threads = arguments.threads;
  }
  if (!arguments.camera_file.empty()) {
    TM_ASSIGN_OR_RETURN(options.cameras, read_cameras(arguments.camera_file));
  }
  return {};
}

Result<std::unique_ptr<ReplayInput>> open_input(const ReplayArguments& arguments) {
  auto input = std::make_unique<ReplayInput>();
  TM_ASSIGN_OR_RETURN(input->recorded,
                      open_photos(arguments.session, Subfolders::kIgnore, MaskUse::kUse));
  auto options = options_of_session(arguments.session, TRIGMESH_VERSION);
  if (options) {
    input->options = *std::move(options);
    input->photos = input->recorded;
  } else if (options.error().code == ErrorCode::kNotFound) {
    input->options = model_options({}, {}, TRIGMESH_VERSION);
    if (input->recorded.timestamps.empty()) {
      return fail(ErrorCode::kInvalidArgument,
                  "cannot replay {}: it is neither a session of the rig (session.json) nor a "
                  "recording with timestamps.csv; use trigmesh reconstruct for photographs",
                  arguments.session);
    }
    const PressMeaning meaning =
        arguments.trigger == "hold" ? PressMeaning::kHold : PressMeaning::kToggle;
    TM_ASSIGN_OR_RETURN(input->photos,
                        frames_while_pressed(input->recorded, arguments.session, meaning));
  } else {
    return tl::unexpected<Error>(std::move(options).error());
  }
  TM_RETURN_IF_ERROR(apply(arguments, input->options));
  return input;
}

/// Names of all files below, sorted.
Result<std::vector<std::string>> files_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (entry->is_regular_file(error)) {
      names.push_back(entry->path().lexically_relative(folder).generic_string());
    }
  }
  if (error) {
    return tl::unexpected<Error>(system_error(error.value(), "cannot list", folder));
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// Files that are not the same in both models, or missing in one of them.
Result<std::vector<std::string>> differences(const fs::path& a, const fs::path& b) {
  TM_ASSIGN_OR_RETURN(const auto names_a, files_in(a));
  TM_ASSIGN_OR_RETURN(const auto names_b, files_in(b));
  std::vector<std::string> different;
  std::set_symmetric_difference(names_a.begin(),
                                names_a.end(),
                                names_b.begin(),
                                names_b.end(),
                                std::back_inserter(different));
  for (const std::string& name : names_a) {
    if (std::binary_search(names_b.begin(), names_b.end(), name)) {
      TM_ASSIGN_OR_RETURN(const std::string bytes_a, read_file(a / name, kMaxComparedBytes));
      TM_ASSIGN_OR_RETURN(const std::string bytes_b, read_file(b / name, kMaxComparedBytes));
      if (bytes_a != bytes_b) {
        different.push_back(name);
      }
    }
  }
  return different;
}

Result<> verify(const ReplayArguments& arguments) {
  const fs::path recorded = fs::path(arguments.session) / "model";
  TM_ASSIGN_OR_RETURN(const auto different,
                      differences(recorded, fs::path(arguments.output) / "model"));
  if (different.empty()) {
    fmt::print("identical to {}\n", recorded.string());
    return {};
  }
  return fail(ErrorCode::kInsufficientData,
              "the replay differs from {} in {} files: {}. Was it made by another version of the "
              "program, on another kind of processor, or stopped before its last stage?",
              recorded.string(),
              different.size(),
              fmt::join(different, ", "));
}

Result<> run(const ReplayArguments& arguments) {
  TM_ASSIGN_OR_RETURN(const auto input, open_input(arguments));
  const auto open = [&](ProgressListener&, const std::stop_token&) -> Result<PhotoSet> {
    return input->photos;
  };
  TM_RETURN_IF_ERROR(run_reconstruction(
      {open, input->options, arguments.session, arguments.output, arguments.quiet}));
  return arguments.verify ? verify(arguments) : Result<>();
}

}  // namespace

void add_replay_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand(
      "replay", "Make the model of a session or recording again, as the rig makes it");
  auto arguments = std::make_shared<ReplayArguments>();
  command->add_option("SESSION", arguments->session, "Folder of a session, or recording")
      ->required();
  command->add_option("-o,--output", arguments->output, "Folder for the result; made when missing")
      ->required();
  command->add_option("--camera",
                      arguments->camera_file,
                      "Known intrinsics, instead of those that the session was captured with: a "
                      "profile of trigmesh calibrate or a COLMAP cameras.txt");
  command
      ->add_option("--trigger",
                   arguments->trigger,
                   "Of a recording with events.csv: frames are taken while the button is held, or "
                   "from one press to the next")
      ->check(CLI::IsMember({"hold", "toggle"}))
      ->capture_default_str();
  command->add_option("--stop-after", arguments->stop_after, "Last stage")
      ->check(CLI::IsMember({"sparse", "dense", "mesh", "texture"}))
      ->capture_default_str();
  command->add_option("--threads", arguments->threads, "Threads at work; 0: as the session says")
      ->check(CLI::Range(0, 256));
  command->add_flag("--verify",
                    arguments->verify,
                    "Compare with the model of the session, byte for byte; exit code 4 when it "
                    "differs");
  command->add_flag("--quiet", arguments->quiet, "No progress");
  command->footer(kFooter);
  command->callback([arguments, &context] { finish_command(context, run(*arguments)); });
}

}  // namespace trigmesh
