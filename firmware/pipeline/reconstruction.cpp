#include "firmware/pipeline/reconstruction.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/checkpoint.hpp"
#include "firmware/pipeline/extraction_stage.hpp"
#include "firmware/pipeline/mapping_stage.hpp"
#include "firmware/pipeline/matching_stage.hpp"
#include "firmware/pipeline/memory_plan.hpp"
#include "firmware/pipeline/model_writer.hpp"
#include "firmware/pipeline/moving_matches.hpp"
#include "firmware/pipeline/reconstruction_report.hpp"
#include "firmware/pipeline/stopwatch.hpp"
#include "firmware/pipeline/surface_building.hpp"
#include "firmware/pipeline/worker_pool.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {

namespace {

constexpr int kMaxThreads = 256;

/// Size of the largest photograph, from the headers of the files; files that cannot be read count
/// as empty.
std::int64_t largest_image_pixels(const PhotoSet& photos) {
  std::int64_t largest = 0;
  for (std::size_t i = 0; i < photos.names.size(); ++i) {
    if (const auto file = photos.read(i)) {
      if (const auto info = probe_image(*file)) {
        largest = std::max(largest, std::int64_t{info->width_px} * info->height_px);
      }
    }
  }
  return largest;
}

Result<MemoryPlan> plan_for(const PhotoSet& photos, const ReconstructionOptions& options) {
  MemoryDemand demand{photos.names.size(), 0, options.num_threads};
  if (options.memory_limit_bytes > 0) {
    demand.largest_image_pixels = largest_image_pixels(photos);
  }
  return plan_memory(demand, options.features, options.memory_limit_bytes);
}

Result<> check_readable(const PhotoSet& photos, const std::vector<ExtractedImage>& images) {
  if (std::any_of(images.begin(), images.end(), [](const ExtractedImage& image) {
        return image.features.has_value();
      })) {
    return {};
  }
  return fail(ErrorCode::kInsufficientData,
              "none of the {} photographs can be read; the first, {}: {}",
              images.size(),
              photos.names.front(),
              images.front().error.message);
}

std::vector<GroupingImage> grouping_images(const PhotoSet& photos,
                                           const std::vector<ExtractedImage>& images) {
  std::vector<GroupingImage> result;
  for (std::size_t i = 0; i < images.size(); ++i) {
    result.push_back({photos.names[i], images[i].features ? &*images[i].features : nullptr});
  }
  return result;
}

/// Whether nothing that could still follow needs the work folder.
bool is_finished(LastStage last) {
  return last == LastStage::kSparse || last == LastStage::kTexture;
}

}  // namespace

Result<> ReconstructionOptions::validate() const {
  TM_RETURN_IF_ERROR(features.validate());
  TM_RETURN_IF_ERROR(mapper.validate());
  TM_RETURN_IF_ERROR(scale.validate());
  TM_RETURN_IF_ERROR(build.validate());
  if (poses && scale.known.any()) {
    return fail(ErrorCode::kInvalidArgument,
                "given poses keep their unit: known lengths cannot be used with them");
  }
  if (num_threads < 1 || num_threads > kMaxThreads) {
    return fail(ErrorCode::kInvalidArgument,
                "the number of threads is {}: it must be in [1, {}]",
                num_threads,
                kMaxThreads);
  }
  for (const Camera& camera : cameras) {
    TM_RETURN_IF_ERROR(camera.validate());
  }
  return {};
}

namespace {

/// What is needed from the first stage to the last.
struct Run {
  const PhotoSet& photos;
  const ReconstructionPlaces& places;
  const ReconstructionOptions& options;
  const CheckpointFolder& checkpoints;
  ProgressListener& listener;
  const std::stop_token& stop;
  Stopwatch& stopwatch;
};

/// Features of all photographs, and which of them share intrinsics.
struct PhotoFeatures {
  std::vector<ExtractedImage> images;
  CameraGroups cameras;
};

Result<PhotoFeatures> extract(const Run& run, const MemoryPlan& plan) {
  WorkerPool pool(plan.extraction_threads, run.stop, &run.listener);
  const StageContext context{pool, run.checkpoints, run.listener, run.stop};
  TM_ASSIGN_OR_RETURN(auto images,
                      extract_photos(run.photos, run.options.feature_kind, plan.features, context));
  TM_RETURN_IF_ERROR(check_readable(run.photos, images));
  TM_ASSIGN_OR_RETURN(CameraGroups cameras,
                      run.options.poses ? groups_of_model(run.photos, images, *run.options.poses)
                                        : group_cameras(grouping_images(run.photos, images),
                                                        run.options.cameras,
                                                        run.options.grouping));
  run.stopwatch.finish(Stage::kExtract);
  return PhotoFeatures{std::move(images), std::move(cameras)};
}

MapperOptions mapper_options(const ReconstructionOptions& options) {
  MapperOptions mapper = options.mapper;
  mapper.seed = options.seed;
  return mapper;
}

Result<std::vector<PairRecord>> match(const Run& run,
                                      const PhotoFeatures& features,
                                      const StageContext& context) {
  const ReconstructionOptions& options = run.options;
  const bool is_walk = run.photos.is_walk || options.frames == FrameUse::kWalk;
  const bool follows_walk = is_walk && options.pair_mode == PairMode::kAuto && !options.poses;
  auto pairs =
      follows_walk
          ? match_walk(features.images, features.cameras, walk_matching_options(options), context)
          : match_photos(features.images,
                         features.cameras,
                         {options.pair_mode, run.photos.ordered, options.seed},
                         context);
  run.stopwatch.finish(Stage::kMatch);
  return pairs;
}

Result<MappedPhotos> map_features(const Run& run,
                                  const PhotoFeatures& features,
                                  const std::vector<PairRecord>& pairs,
                                  const StageContext& context) {
  const auto& [images, cameras] = features;
  const MapperOptions mapper = mapper_options(run.options);
  return run.options.poses
             ? map_known_poses(
                   run.photos, images, cameras, pairs, {*run.options.poses, mapper}, context)
             : map_photos(run.photos, images, cameras, pairs, mapper, context);
}

/// The models in metres, where known lengths allow it.
Result<ScaledModels> scale_models(const Run& run,
                                  std::vector<Scene> components,
                                  const StageContext& context) {
  auto models = find_metric_scale(run.photos, std::move(components), run.options.scale, context);
  if (run.options.scale.known.any()) {
    run.stopwatch.finish(Stage::kScale);
  }
  return models;
}

/// What mapping is made from, and what the report tells of it.
struct MappingInput {
  const MemoryPlan& plan;
  const PhotoFeatures& features;
  const std::vector<PairRecord>& pairs;
};

/// The models that can be seen.
struct PublishedModels {
  std::vector<Scene> components;
  ReconstructionSummary summary;
};

Result<PublishedModels> publish(const Run& run,
                                const MappingInput& input,
                                MappedPhotos mapped,
                                const StageContext& context) {
  TM_ASSIGN_OR_RETURN(ScaledModels models,
                      scale_models(run, std::move(mapped.components), context));
  run.listener.on_progress({Stage::kWrite, 0, 1});
  ReconstructionSummary summary{report_on(run.photos,
                                          run.options,
                                          input.plan,
                                          input.features.cameras,
                                          input.pairs,
                                          {mapped.outcomes, models}),
                                {}};
  TM_RETURN_IF_ERROR(write_model(run.places.model, models.components, summary.report));
  run.listener.on_progress({Stage::kWrite, 1, 1});
  run.stopwatch.finish(Stage::kWrite);
  return PublishedModels{std::move(models.components), std::move(summary)};
}

/// The model that comes of the matches on what stood still, when the poses of the first one show
/// that something moved. Nothing when nothing did, or when it would hold fewer images.
Result<std::optional<MappedPhotos>> map_what_stood_still(const Run& run,
                                                         const MappingInput& input,
                                                         const Scene& first,
                                                         const StageContext& context) {
  TM_ASSIGN_OR_RETURN(const auto still,
                      drop_moving_matches(first, input.features.images, input.pairs, context));
  run.stopwatch.finish(Stage::kMoving);
  if (!still) {
    return std::optional<MappedPhotos>();
  }
  TM_ASSIGN_OR_RETURN(MappedPhotos again, map_features(run, input.features, *still, context));
  run.stopwatch.finish(Stage::kMap);
  const bool holds_as_many =
      !again.components.empty() &&
      again.components.front().registered_count() >= first.registered_count();
  return holds_as_many ? std::optional(std::move(again)) : std::nullopt;
}

/// The first model is published before it is known whether something moved: somebody waits for it.
Result<PublishedModels> map_and_publish(const Run& run,
                                        const MappingInput& input,
                                        const StageContext& context) {
  TM_ASSIGN_OR_RETURN(MappedPhotos mapped, map_features(run, input.features, input.pairs, context));
  run.stopwatch.finish(Stage::kMap);
  TM_ASSIGN_OR_RETURN(PublishedModels published, publish(run, input, std::move(mapped), context));
  if (run.options.build.moving == MovingUse::kOff || published.components.empty()) {
    return published;
  }
  TM_ASSIGN_OR_RETURN(auto still,
                      map_what_stood_still(run, input, published.components.front(), context));
  return still ? publish(run, input, *std::move(still), context) : std::move(published);
}

Result<ReconstructionSummary> run_stages(const Run& run) {
  const ReconstructionOptions& options = run.options;
  TM_ASSIGN_OR_RETURN(const MemoryPlan plan, plan_for(run.photos, options));
  WorkerPool pool(options.num_threads, run.stop, &run.listener);
  const StageContext context{pool, run.checkpoints, run.listener, run.stop};
  TM_ASSIGN_OR_RETURN(const PhotoFeatures features, extract(run, plan));
  TM_ASSIGN_OR_RETURN(const auto pairs, match(run, features, context));
  TM_ASSIGN_OR_RETURN(PublishedModels models,
                      map_and_publish(run, {plan, features, pairs}, context));
  if (!models.components.empty()) {
    TM_RETURN_IF_ERROR(build_surface({run.photos, models.components, run.places.model, options},
                                     context,
                                     run.stopwatch,
                                     models.summary.report));
  }
  return std::move(models.summary);
}

/// What the selector has to know of the lens.
KeyframeOptions keyframe_options(const ReconstructionOptions& options) {
  KeyframeOptions keyframes;
  if (!options.cameras.empty()) {
    const Camera& camera = options.cameras.front();
    keyframes.focal_ratio =
        focal_ratio_of(camera.fx_px, std::max(camera.width_px, camera.height_px));
  }
  return keyframes;
}

/// All stages, on the keyframes if the photographs are frames of a video.
Result<ReconstructionSummary> run_on_frames(const Run& run) {
  TM_ASSIGN_OR_RETURN(const bool selects, wants_keyframes(run.photos, run.options.frames));
  if (!selects) {
    return run_stages(run);
  }
  const auto chosen = [&]() -> Result<PhotoSet> {
    WorkerPool pool(run.options.num_threads, run.stop, &run.listener);
    return choose_keyframes(
        run.photos, keyframe_options(run.options), {pool, run.checkpoints, run.listener, run.stop});
  }();
  TM_RETURN_IF_ERROR(chosen);
  run.stopwatch.finish(Stage::kSelectFrames);
  return run_stages(
      {*chosen, run.places, run.options, run.checkpoints, run.listener, run.stop, run.stopwatch});
}

/// Writes the times and tidies up.
Result<> finish(const Run& run, ReconstructionSummary& summary) {
  summary.times = run.stopwatch.times();
  if (!run.places.timings.empty()) {
    TM_RETURN_IF_ERROR(write_timings(run.places.timings, summary.times));
  }
  if (is_finished(run.options.build.last_stage) &&
      run.places.finished_work == ReconstructionPlaces::FinishedWork::kDiscard) {
    run.checkpoints.discard();
  }
  return {};
}

/// Whatever stage it was in.
template <typename Work>
auto stoppable(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const WorkStopped&) {
    return fail(ErrorCode::kCancelled, "stopped; finished stages are kept");
  }
}

}  // namespace

Result<ReconstructionSummary> reconstruct(const PhotoSet& photos,
                                          const ReconstructionPlaces& places,
                                          const ReconstructionOptions& options,
                                          const Clock& clock,
                                          ProgressListener& listener,
                                          const std::stop_token& stop) {
  TM_RETURN_IF_ERROR(options.validate());
  if (photos.names.empty()) {
    return fail(ErrorCode::kInsufficientData, "there are no photographs to reconstruct from");
  }
  TM_ASSIGN_OR_RETURN(const CheckpointFolder checkpoints, CheckpointFolder::open(places.work));
  Stopwatch stopwatch(clock);
  const Run run{photos, places, options, checkpoints, listener, stop, stopwatch};
  TM_ASSIGN_OR_RETURN(ReconstructionSummary summary, stoppable([&] { return run_on_frames(run); }));
  TM_RETURN_IF_ERROR(finish(run, summary));
  return summary;
}

Result<ReconstructionSummary> reconstruct(const PhotoSet& photos,
                                          const std::filesystem::path& output,
                                          const ReconstructionOptions& options,
                                          const Clock& clock,
                                          ProgressListener& listener,
                                          const std::stop_token& stop) {
  ModelFolder folder(output);
  const ReconstructionPlaces places{folder, output / "work", output / "timings.json"};
  return reconstruct(photos, places, options, clock, listener, stop);
}

Result<ReconstructionSummary> continue_model(const ExistingModel& model,
                                             const PhotoSet& photos,
                                             const std::filesystem::path& output,
                                             const ReconstructionOptions& options,
                                             const Clock& clock,
                                             ProgressListener& listener,
                                             const std::stop_token& stop) {
  TM_RETURN_IF_ERROR(options.validate());
  TM_RETURN_IF_ERROR(make_directory(output));
  TM_ASSIGN_OR_RETURN(const CheckpointFolder checkpoints, CheckpointFolder::open(output / "work"));
  ModelFolder folder(output);
  WorkerPool pool(options.num_threads, stop, &listener);
  Stopwatch stopwatch(clock);
  ReconstructionSummary summary{report_on_model(photos, options, model), {}};
  std::error_code error;
  if (!std::filesystem::is_directory(folder.model(), error)) {
    TM_RETURN_IF_ERROR(write_model(folder, model.components, summary.report));
    stopwatch.finish(Stage::kWrite);
  }
  const StageContext context{pool, checkpoints, listener, stop};
  const BuildInput input{photos, model.components, folder, options};
  TM_RETURN_IF_ERROR(
      stoppable([&] { return build_surface(input, context, stopwatch, summary.report); }));
  summary.times = stopwatch.times();
  TM_RETURN_IF_ERROR(write_timings(output / "timings.json", summary.times));
  return summary;
}

}  // namespace trigmesh
