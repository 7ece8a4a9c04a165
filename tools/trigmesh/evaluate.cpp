// trigmesh evaluate: scores the poses of a model against true ones.

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "firmware/base/check.hpp"
#include "sfm/exchange/colmap_text.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "sfm/geometry/pose_evaluation.hpp"
#include "tools/trigmesh/command.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter =
    R"(MODEL is a result of `trigmesh reconstruct`, its model folder, or a folder of COLMAP files.
Images are paired by file name without folder and extension. Positions are compared after the
best similarity (with --metric: the best rigid motion), in the units of the truth. auc@N is the
area under the recall of relative pose errors over all pairs of images, up to N degrees; pairs
with an image that the model lacks count as wrong.

Exit code 4 when the model shares fewer than 3 images with the truth or misses a threshold.

Examples:
  trigmesh evaluate out --truth truth/images.txt
  trigmesh evaluate out --truth truth/images.txt --max-rmse 0.003 --min-registered 11
  trigmesh evaluate out --truth truth/images.txt --metric --json
)";

struct EvaluateOptions {
  std::string model;
  std::string truth;
  bool metric = false;
  bool json = false;
  std::optional<double> max_rmse;
  std::optional<std::size_t> min_registered;
  std::optional<double> min_auc1;
};

/// An images.txt, or a folder that holds a model.
Result<std::vector<NamedPose>> read_truth(const std::filesystem::path& path) {
  std::error_code ignored;  // what cannot be looked at is read as a file, which says why
  if (std::filesystem::is_directory(path, ignored)) {
    return read_model_poses(path);
  }
  TM_ASSIGN_OR_RETURN(const std::string text, read_file(path, kMaxModelFileBytes));
  return read_colmap_poses(text).map_error([&](Error error) {
    error.message = fmt::format("{}: {}", path.string(), error.message);
    return error;
  });
}

void print_line(const PoseEvaluation& score) {
  fmt::print(
      "registered {}/{}  rmse {:.5f}  median {:.5f}  max {:.5f}  rot_med {:.4f} deg  "
      "auc@1 {:.4f} auc@3 {:.4f} auc@5 {:.4f}\n",
      score.registered,
      score.truth_count,
      score.position_rmse,
      score.position_median,
      score.position_max,
      score.rotation_median_deg,
      score.auc_1_deg,
      score.auc_3_deg,
      score.auc_5_deg);
}

void print_json(const PoseEvaluation& score) {
  const nlohmann::ordered_json json{{"registered", score.registered},
                                    {"truth", score.truth_count},
                                    {"position_rmse", score.position_rmse},
                                    {"position_median", score.position_median},
                                    {"position_max", score.position_max},
                                    {"rotation_median_deg", score.rotation_median_deg},
                                    {"auc_1_deg", score.auc_1_deg},
                                    {"auc_3_deg", score.auc_3_deg},
                                    {"auc_5_deg", score.auc_5_deg}};
  fmt::print("{}\n", json.dump(2));
}

Result<> check_thresholds(const PoseEvaluation& score, const EvaluateOptions& options) {
  if (options.min_registered && score.registered < *options.min_registered) {
    return fail(ErrorCode::kInsufficientData,
                "{} images are registered, {} are required",
                score.registered,
                *options.min_registered);
  }
  if (options.max_rmse && score.position_rmse > *options.max_rmse) {
    return fail(ErrorCode::kInsufficientData,
                "the position rmse is {:.6g}, at most {} is required",
                score.position_rmse,
                *options.max_rmse);
  }
  if (options.min_auc1 && score.auc_1_deg < *options.min_auc1) {
    return fail(ErrorCode::kInsufficientData,
                "auc@1 is {:.6g}, at least {} is required",
                score.auc_1_deg,
                *options.min_auc1);
  }
  return {};
}

Result<> evaluate(const EvaluateOptions& options) {
  TM_ASSIGN_OR_RETURN(const std::vector<NamedPose> truth, read_truth(options.truth));
  TM_ASSIGN_OR_RETURN(const std::vector<NamedPose> estimate, read_model_poses(options.model));
  TM_ASSIGN_OR_RETURN(
      const PoseEvaluation score,
      evaluate_poses(
          truth, estimate, options.metric ? ScaleAlignment::kMeasured : ScaleAlignment::kFitted));
  if (options.json) {
    print_json(score);
  } else {
    print_line(score);
  }
  return check_thresholds(score, options);
}

}  // namespace

void add_evaluate_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("evaluate", "Score the camera poses of a model");
  const auto options = std::make_shared<EvaluateOptions>();  // shared by the callback's copies
  command->add_option("MODEL", options->model, "The model to score")->required();
  command->add_option("--truth", options->truth, "True poses: COLMAP images.txt, or a model")
      ->required();
  command->add_flag("--metric", options->metric, "Count a wrong scale as an error");
  command->add_flag("--json", options->json, "Print a JSON object instead of a line");
  command->add_option("--max-rmse", options->max_rmse, "Largest position error to accept")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--min-registered", options->min_registered, "Fewest images to accept");
  command->add_option("--min-auc1", options->min_auc1, "Smallest auc@1 to accept, 0 to 1")
      ->check(CLI::Range(0.0, 1.0));
  command->footer(kFooter);
  command->callback([options, &context] { finish_command(context, evaluate(*options)); });
}

}  // namespace trigmesh
