#include "firmware/pipeline/dense_stage.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "firmware/base/binary_stream.hpp"
#include "firmware/base/check.hpp"
#include "sfm/dense/depth_filter.hpp"
#include "sfm/dense/fusion.hpp"
#include "sfm/dense/undistortion.hpp"

namespace trigmesh {

namespace {

/// A picture resized, with its camera and mask.
StereoImage scaled_image(const StereoImage& image, double scale) {
  StereoImage scaled;
  scaled.camera = scaled_pinhole(image.camera,
                                 scaled_side(image.camera.width_px, scale),
                                 scaled_side(image.camera.height_px, scale));
  scaled.cam_from_world = image.cam_from_world;
  const cv::Size size(scaled.camera.width_px, scaled.camera.height_px);
  cv::resize(image.grey, scaled.grey, size, 0.0, 0.0, cv::INTER_AREA);
  if (!image.mask.empty()) {
    cv::resize(image.mask, scaled.mask, size, 0.0, 0.0, cv::INTER_NEAREST);
  }
  return scaled;
}

/// The pictures at the size of the depth maps.
Result<std::vector<StereoImage>> load_stereo_images(const DenseInput& input,
                                                    const StageContext& context) {
  std::vector<StereoImage> images(input.views.size());
  std::vector<std::optional<Error>> failures(input.views.size());
  context.executor.for_each_index(input.views.size(), [&](std::size_t i) {
    if (context.stop.stop_requested()) {
      return;
    }
    const auto picture = input.images.load(i);
    if (!picture) {
      failures[i] = picture.error();
      return;
    }
    StereoImage image{.grey = {},
                      .mask = picture->mask,
                      .camera = input.views[i].camera,
                      .cam_from_world = input.views[i].cam_from_world};
    cv::cvtColor(picture->rgb, image.grey, cv::COLOR_RGB2GRAY);
    images[i] = scaled_image(image, input.plan.map_scale);
  });
  for (const std::optional<Error>& failure : failures) {
    if (failure) {
      return tl::unexpected(*failure);
    }
  }
  if (context.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "stopped while reading photographs for depth maps");
  }
  return images;
}

std::uint64_t key_of_view(const DenseView& view, std::uint64_t content) {
  BinaryWriter parts;
  parts.value(content);
  const IntrinsicsVector intrinsics = view.camera.intrinsics();
  const Eigen::Matrix<double, 3, 4> pose = view.cam_from_world.matrix();
  parts.items(std::vector<double>(intrinsics.data(), intrinsics.data() + intrinsics.size()));
  parts.items(std::vector<double>(pose.data(), pose.data() + pose.size()));
  return content_hash(parts.take());
}

/// Per view a hash of everything that its photometric map depends on.
Result<std::vector<std::uint64_t>> photometric_keys(const DenseInput& input,
                                                    std::span<const StereoPlan> plans) {
  std::vector<std::uint64_t> of_view;
  for (std::size_t i = 0; i < input.views.size(); ++i) {
    TM_ASSIGN_OR_RETURN(const std::uint64_t content, input.images.content(i));
    of_view.push_back(key_of_view(input.views[i], content));
  }
  const PatchMatchOptions& options = input.plan.patch_match;
  const std::uint64_t settings = content_hash(fmt::format("{} {} {} {} {} {} {} {} {} {}",
                                                          input.plan.map_scale,
                                                          input.plan.first_round_scale,
                                                          options.levels,
                                                          options.coarse_iterations,
                                                          options.middle_iterations,
                                                          options.fine_iterations,
                                                          options.geometric_iterations,
                                                          options.geometric_weight,
                                                          options.grey_sigma,
                                                          input.seed));
  std::vector<std::uint64_t> keys;
  for (std::size_t i = 0; i < plans.size(); ++i) {
    BinaryWriter parts;
    parts.value(settings);
    parts.value(of_view[i]);
    for (const std::size_t source : plans[i].sources) {
      parts.value(of_view[source]);
    }
    parts.value(plans[i].min_depth);
    parts.value(plans[i].max_depth);
    for (const Eigen::Vector3f& seed : plans[i].seeds_in_cam) {
      parts.items(std::vector<float>(seed.data(), seed.data() + seed.size()));
    }
    keys.push_back(content_hash(parts.take()));
  }
  return keys;
}

/// Keys of maps that are made from those with the given keys of a view and its neighbours, which
/// include its sources.
std::vector<std::uint64_t> next_keys(std::span<const std::uint64_t> keys,
                                     std::span<const StereoPlan> plans) {
  std::vector<std::uint64_t> next;
  for (std::size_t i = 0; i < plans.size(); ++i) {
    BinaryWriter parts;
    parts.value(keys[i]);
    for (const std::size_t neighbor : plans[i].neighbors) {
      parts.value(keys[neighbor]);
    }
    next.push_back(content_hash(parts.take()));
  }
  return next;
}

Result<std::vector<DepthMap>> load_maps(const DepthMapSource& maps,
                                        std::span<const std::size_t> views) {
  std::vector<DepthMap> loaded;
  for (const std::size_t view : views) {
    TM_ASSIGN_OR_RETURN(DepthMap map, maps.load(view));
    loaded.push_back(std::move(map));
  }
  return loaded;
}

/// What the filter of a view works on.
struct FilterInput {
  const DenseInput& dense;
  std::span<const StereoPlan> plans;
  std::span<const StereoImage> images;
  const DepthMapSource& maps;  ///< unfiltered
};

/// The map of a view as far as the mask leaves it in.
Result<PosedDepthMap> load_posed(const FilterInput& input, std::size_t view) {
  TM_ASSIGN_OR_RETURN(DepthMap map, input.maps.load(view));
  if (!map.depth.empty() && !input.images[view].mask.empty()) {
    map.depth.setTo(0.0, input.images[view].mask == 0);
  }
  return PosedDepthMap{std::move(map), input.dense.views[view].cam_from_world};
}

Result<DepthMap> filtered_map(const FilterInput& input,
                              std::size_t view,
                              const StageContext& context) {
  TM_ASSIGN_OR_RETURN(const PosedDepthMap map, load_posed(input, view));
  std::vector<PosedDepthMap> neighbors;
  for (const std::size_t neighbor : input.plans[view].neighbors) {
    TM_ASSIGN_OR_RETURN(PosedDepthMap other, load_posed(input, neighbor));
    neighbors.push_back(std::move(other));
  }
  return filter_depth_map(
      map, input.images[view].mask, neighbors, input.dense.plan.filter, context.executor);
}

std::uint64_t key_of_all(const std::vector<std::uint64_t>& keys) {
  BinaryWriter all;
  all.items(keys);
  return content_hash(all.take());
}

/// Stereo of one view with its sources, at `scale` times the size of `images`.
StereoProblem problem_of(std::size_t view,
                         const StereoPlan& plan,
                         std::span<const StereoImage> images,
                         double scale) {
  const auto at_scale = [&](std::size_t i) {
    return scale == 1.0 ? images[i] : scaled_image(images[i], scale);
  };
  StereoProblem problem;
  problem.reference = at_scale(view);
  for (const std::size_t source : plan.sources) {
    problem.sources.push_back(at_scale(source));
  }
  problem.seeds_in_cam = plan.seeds_in_cam;
  problem.min_depth = plan.min_depth;
  problem.max_depth = plan.max_depth;
  return problem;
}

/// Whether there is something to compare with, at a depth that is known about.
bool can_have_map(const StereoPlan& plan) {
  return !plan.sources.empty() && plan.max_depth > 0.0F;
}

/// The rounds one after the other; each finished map counts as one step of the stage.
class DepthRounds {
 public:
  static constexpr std::size_t kRounds = 3;

  DepthRounds(const DenseInput& input,
              std::span<const StereoPlan> plans,
              const StageContext& context)
      : input_(input),
        plans_(plans),
        context_(context),
        progress_(context, Stage::kDepth, kRounds * input.views.size()) {}

  /// Calls `make(view)` for every view whose map is not in `store` yet.
  template <typename Make>
  Result<> run(const DepthMapStore& store, const Make& make) {
    for (std::size_t view = 0; view < input_.views.size(); ++view) {
      if (context_.stop.stop_requested()) {
        return fail(ErrorCode::kCancelled,
                    "stopped while making depth maps; finished maps are kept");
      }
      if (!store.has(view)) {
        TM_ASSIGN_OR_RETURN(const DepthMap map,
                            can_have_map(plans_[view]) ? make(view) : Result<DepthMap>(DepthMap{}));
        TM_RETURN_IF_ERROR(store.save(view, map));
      }
      progress_.advance();
    }
    return {};
  }

 private:
  const DenseInput& input_;
  std::span<const StereoPlan> plans_;
  const StageContext& context_;
  StageProgress progress_;
};

Result<> check_enough(std::span<const StereoPlan> plans) {
  if (std::any_of(plans.begin(), plans.end(), can_have_map)) {
    return {};
  }
  return fail(ErrorCode::kInsufficientData,
              "no depth maps can be made: no two of the {} views see enough of the same points",
              plans.size());
}

}  // namespace

Result<DepthMaps> make_depth_maps(const DenseInput& input, const StageContext& context) {
  TM_ASSIGN_OR_RETURN(std::vector<StereoPlan> plans,
                      plan_stereo(input.scene, input.views, input.plan.selection));
  TM_RETURN_IF_ERROR(check_enough(plans));
  TM_ASSIGN_OR_RETURN(const std::vector<StereoImage> images, load_stereo_images(input, context));
  TM_ASSIGN_OR_RETURN(const auto photometric_key, photometric_keys(input, plans));
  const auto geometric_key = next_keys(photometric_key, plans);
  const auto filtered_key = next_keys(geometric_key, plans);
  PatchMatchOptions options = input.plan.patch_match;
  options.seed = input.seed + 1;
  DepthRounds rounds(input, plans, context);

  const DepthMapStore photometric(context.checkpoints, "photometric", photometric_key);
  TM_RETURN_IF_ERROR(rounds.run(photometric, [&](std::size_t view) {
    return estimate_depth_map(problem_of(view, plans[view], images, input.plan.first_round_scale),
                              options,
                              context.executor);
  }));

  DepthMapStore geometric(context.checkpoints, "geometric", geometric_key);
  TM_RETURN_IF_ERROR(rounds.run(geometric, [&](std::size_t view) -> Result<DepthMap> {
    StereoProblem problem = problem_of(view, plans[view], images, 1.0);
    TM_ASSIGN_OR_RETURN(problem.initial, photometric.load(view));
    TM_ASSIGN_OR_RETURN(problem.source_maps, load_maps(photometric, plans[view].sources));
    return estimate_depth_map(problem, options, context.executor);
  }));

  DepthMapStore filtered(context.checkpoints, "depth", filtered_key);
  TM_RETURN_IF_ERROR(rounds.run(filtered, [&](std::size_t view) {
    return filtered_map({input, plans, images, geometric}, view, context);
  }));
  return DepthMaps{
      std::move(filtered), std::move(geometric), std::move(plans), key_of_all(filtered_key)};
}

Result<DepthMaps> filter_masked(const DenseInput& input,
                                DepthMaps depth,
                                const StageContext& context) {
  TM_ASSIGN_OR_RETURN(const std::vector<StereoImage> images, load_stereo_images(input, context));
  std::vector<std::uint64_t> with_mask;
  for (std::size_t view = 0; view < input.views.size(); ++view) {
    TM_ASSIGN_OR_RETURN(const std::uint64_t content, input.images.content(view));
    with_mask.push_back(content_hash(fmt::format("{} {}", depth.key, content)));
  }
  const std::vector<std::uint64_t> keys = next_keys(with_mask, depth.stereo);
  DepthMapStore masked(context.checkpoints, "masked", keys);
  for (std::size_t view = 0; view < input.views.size(); ++view) {
    if (context.stop.stop_requested()) {
      return fail(ErrorCode::kCancelled,
                  "stopped while masking depth maps; finished maps are kept");
    }
    if (!masked.has(view)) {
      TM_ASSIGN_OR_RETURN(
          const DepthMap map,
          can_have_map(depth.stereo[view])
              ? filtered_map({input, depth.stereo, images, depth.unfiltered}, view, context)
              : Result<DepthMap>(DepthMap{}));
      TM_RETURN_IF_ERROR(masked.save(view, map));
    }
  }
  return DepthMaps{
      std::move(masked), std::move(depth.unfiltered), std::move(depth.stereo), key_of_all(keys)};
}

Result<DenseCloud> fuse_maps(const DenseInput& input,
                             const DepthMaps& depth,
                             const StageContext& context) {
  context.listener.on_progress({Stage::kFuse, 0, 1});
  std::vector<std::vector<std::size_t>> neighbors;
  for (const StereoPlan& plan : depth.stereo) {
    neighbors.push_back(plan.neighbors);
  }
  TM_ASSIGN_OR_RETURN(DenseCloud cloud,
                      fuse_depth_maps({input.views, neighbors, &depth.maps, &input.images},
                                      input.plan.fusion,
                                      context.executor));
  context.listener.on_progress({Stage::kFuse, 1, 1});
  return cloud;
}

}  // namespace trigmesh
