#include "sfm/dense/patch_match.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/check.hpp"
#include "sfm/dense/patch_match_sweep.hpp"
#include "sfm/dense/plane_field.hpp"
#include "sfm/dense/plane_hints.hpp"
#include "sfm/dense/stereo_level.hpp"

namespace trigmesh {

namespace {

/// The coarsest picture still has this many pixels on its smaller side.
constexpr int kSmallestSide_px = 32;

Result<> check_image(const StereoImage& image, const char* what) {
  const bool fits = image.camera.model == CameraModel::kPinhole && image.grey.type() == CV_8UC1 &&
                    image.grey.cols == image.camera.width_px &&
                    image.grey.rows == image.camera.height_px && image.grey.cols >= 2 &&
                    image.grey.rows >= 2 &&
                    std::int64_t{image.grey.cols} * image.grey.rows <= kMaxSourcePixels &&
                    (image.mask.empty() ||
                     (image.mask.type() == CV_8UC1 && image.mask.size() == image.grey.size()));
  if (!fits) {
    return fail(ErrorCode::kInvalidArgument,
                "{} is no grey picture of {}x{} pixels (with a mask of the same size) of a pinhole "
                "camera",
                what,
                image.camera.width_px,
                image.camera.height_px);
  }
  return {};
}

Result<> check_map(const DepthMap& map, const char* what) {
  const bool fits =
      map.depth.empty() ||
      (map.depth.type() == CV_32FC1 && map.normal.type() == CV_32FC3 &&
       map.confidence.type() == CV_8UC1 && map.normal.size() == map.depth.size() &&
       map.confidence.size() == map.depth.size() && map.camera.width_px == map.depth.cols &&
       map.camera.height_px == map.depth.rows);
  if (!fits) {
    return fail(ErrorCode::kInvalidArgument, "{} and its camera differ in size or type", what);
  }
  return {};
}

Result<> check_problem(const StereoProblem& problem) {
  TM_RETURN_IF_ERROR(check_image(problem.reference, "the reference"));
  if (problem.sources.empty() || problem.sources.size() > kMaxStereoSources) {
    return fail(ErrorCode::kInvalidArgument,
                "{} source views, not 1 to {}",
                problem.sources.size(),
                kMaxStereoSources);
  }
  if (!(problem.min_depth > 0.0F && problem.min_depth < problem.max_depth &&
        std::isfinite(problem.max_depth))) {
    return fail(ErrorCode::kInvalidArgument,
                "depth range {} to {} is none",
                problem.min_depth,
                problem.max_depth);
  }
  for (const StereoImage& source : problem.sources) {
    TM_RETURN_IF_ERROR(check_image(source, "a source"));
  }
  if (!problem.source_maps.empty() && problem.source_maps.size() != problem.sources.size()) {
    return fail(ErrorCode::kInvalidArgument,
                "{} maps for {} source views",
                problem.source_maps.size(),
                problem.sources.size());
  }
  for (std::size_t s = 0; s < problem.source_maps.size(); ++s) {
    TM_RETURN_IF_ERROR(check_map(problem.source_maps[s], "a source's map"));
  }
  return check_map(problem.initial, "the map to begin with");
}

InverseDepthRange range_of(const StereoProblem& problem) {
  return {1.0F / problem.max_depth, 1.0F / problem.min_depth};
}

int halvings_of(const StereoProblem& problem, int levels) {
  const int side = std::min(problem.reference.grey.cols, problem.reference.grey.rows);
  int halvings = 0;
  while (halvings + 1 < levels && (side >> (halvings + 1)) >= kSmallestSide_px) {
    ++halvings;
  }
  return halvings;
}

PlaneField photometric_round(const StereoProblem& problem,
                             const PatchMatchOptions& options,
                             Executor& executor) {
  const int coarsest = halvings_of(problem, options.levels);
  PlaneField field;
  std::uint64_t pass = 0;
  for (int halvings = coarsest; halvings >= 0; --halvings) {
    const StereoLevel level = make_stereo_level(problem, halvings);
    SweepPlan plan{
        .level = &level,
        .range = range_of(problem),
        .search = halvings == 0 && coarsest > 0 ? SweepSearch::kFine : SweepSearch::kWide,
        .grey_sigma = options.grey_sigma};
    field = halvings == coarsest
                ? field_from_seeds(level.camera, problem.seeds_in_cam, plan.range)
                : resample_field(field, level.camera.width_px, level.camera.height_px);
    const int sweeps = halvings == coarsest ? options.coarse_iterations
                       : halvings > 0       ? options.middle_iterations
                                            : options.fine_iterations;
    plan.seed = options.seed * 1000 + pass++;
    SweepPlan first = plan;
    first.search = halvings == coarsest ? SweepSearch::kWide : SweepSearch::kFine;
    initialize_field(first, field, executor);
    for (int i = 0; i < sweeps; ++i) {
      plan.seed = options.seed * 1000 + pass++;
      plan.step_px = i + 1 < sweeps ? 0.5F : 0.3F;
      sweep_field(plan, field, executor);
    }
  }
  return field;
}

PlaneField geometric_round(const StereoProblem& problem,
                           const PatchMatchOptions& options,
                           Executor& executor) {
  const StereoLevel level = make_stereo_level(problem, 0);
  const std::vector<std::vector<PlaneHypothesis>> hints = plane_hints(problem);
  PlaneField field = field_from_depth_map(problem.initial);
  if (field.width_px != level.camera.width_px || field.height_px != level.camera.height_px) {
    field = resample_field(field, level.camera.width_px, level.camera.height_px);
  }
  SweepPlan plan{.level = &level,
                 .range = range_of(problem),
                 .search = SweepSearch::kFine,
                 .step_px = 0.3F,
                 .grey_sigma = options.grey_sigma,
                 .geometric_weight = options.geometric_weight,
                 .seed = options.seed * 1000 + 500};
  initialize_field(plan, field, executor);
  for (int i = 0; i < options.geometric_iterations; ++i) {
    plan.hints = i == 0 ? &hints : nullptr;
    ++plan.seed;
    sweep_field(plan, field, executor);
  }
  return field;
}

}  // namespace

Result<> PatchMatchOptions::validate() const {
  const auto check = [](const char* name, int value, int low, int high) -> Result<> {
    if (value < low || value > high) {
      return fail(ErrorCode::kInvalidArgument, "{} is {}, not in [{}, {}]", name, value, low, high);
    }
    return {};
  };
  TM_RETURN_IF_ERROR(check("levels", levels, 1, 6));
  TM_RETURN_IF_ERROR(check("coarse_iterations", coarse_iterations, 1, 32));
  TM_RETURN_IF_ERROR(check("middle_iterations", middle_iterations, 1, 32));
  TM_RETURN_IF_ERROR(check("fine_iterations", fine_iterations, 1, 32));
  TM_RETURN_IF_ERROR(check("geometric_iterations", geometric_iterations, 1, 32));
  if (!(geometric_weight >= 0.0F && geometric_weight <= 1.0F)) {
    return fail(
        ErrorCode::kInvalidArgument, "geometric_weight is {}, not in [0, 1]", geometric_weight);
  }
  if (!(grey_sigma > 0.0F && grey_sigma <= 255.0F)) {
    return fail(ErrorCode::kInvalidArgument, "grey_sigma is {}, not in (0, 255]", grey_sigma);
  }
  return {};
}

Result<DepthMap> estimate_depth_map(const StereoProblem& problem,
                                    const PatchMatchOptions& options,
                                    Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  TM_RETURN_IF_ERROR(check_problem(problem));
  const PlaneField field = problem.initial.depth.empty()
                               ? photometric_round(problem, options, executor)
                               : geometric_round(problem, options, executor);
  return depth_map_from_field(field, problem.reference.camera);
}

std::size_t estimate_memory_bytes(int width_px, int height_px, std::size_t sources) {
  TM_CHECK(width_px > 0 && height_px > 0);
  const std::size_t pixels =
      static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  constexpr std::size_t kBytesOfField = sizeof(PlaneHypothesis) + sizeof(float) + 1;
  constexpr std::size_t kBytesOfMap = 4 + 12 + 1;
  constexpr std::size_t kBytesOfHints = 2 * (sizeof(PlaneHypothesis) + 1);
  const std::size_t bytes_of_sources = 8 * sources;  // quads, inverse depth
  return pixels * (2 * kBytesOfField + kBytesOfMap + kBytesOfHints + bytes_of_sources);
}

}  // namespace trigmesh
