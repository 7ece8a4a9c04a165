#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/base/result.hpp"
#include "firmware/pipeline/build_options.hpp"
#include "firmware/pipeline/camera_groups.hpp"
#include "firmware/pipeline/existing_model.hpp"
#include "firmware/pipeline/model_place.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/progress.hpp"
#include "firmware/pipeline/report.hpp"
#include "firmware/pipeline/scale_stage.hpp"
#include "firmware/pipeline/stopwatch.hpp"
#include "firmware/pipeline/video_frames.hpp"
#include "sfm/features/features.hpp"
#include "sfm/mapping/mapper.hpp"
#include "sfm/matching/pair_selection.hpp"

namespace trigmesh {

/// Settings of a reconstruction.
struct ReconstructionOptions {
  FrameUse frames = FrameUse::kAuto;
  FeatureKind feature_kind = FeatureKind::kSift;
  FeatureOptions features;
  PairMode pair_mode = PairMode::kAuto;
  GroupingMode grouping = GroupingMode::kAuto;
  std::vector<Camera> cameras;  ///< given intrinsics; empty when none are known
  std::optional<Scene> poses;   ///< given cameras and poses: nothing is solved but the points
  MapperOptions mapper;
  ScaleOptions scale;  ///< known lengths for a model in metres; not together with `poses`
  BuildOptions build;  ///< what follows after mapping, and where it ends
  /// Threads that work, [1, 256]. The result does not depend on it.
  int num_threads = 1;
  /// Most memory to use, bytes; 0 for no limit. Quality is lowered in declared steps to keep it.
  std::uint64_t memory_limit_bytes = 0;
  std::uint64_t seed = 0;
  std::string software_version;

  [[nodiscard]] Result<> validate() const;
};

/// What a finished reconstruction says of itself.
struct ReconstructionSummary {
  ReconstructionReport report;
  std::vector<StageTime> times;
};

/// Where a reconstruction leaves what it makes.
struct ReconstructionPlaces {
  enum class FinishedWork { kDiscard, kKeep };

  ModelPlace& model;
  std::filesystem::path
      work;  ///< folder of finished pieces, from which an interrupted call goes on
  std::filesystem::path timings;  ///< file of seconds per stage; empty: none
  /// Whether the work folder stays when nothing that could still follow needs it.
  FinishedWork finished_work = FinishedWork::kDiscard;
};

/// Photographs in, cameras and coloured cloud out: extracts, matches, maps, and publishes the model
/// at its place, each result as soon as it exists. An interrupted call with the same photographs
/// and options goes on from the work folder. A stop request is looked at by every stage, many times
/// a second.
///
/// Errors: kInvalidArgument (options), kInsufficientData (no photograph, none readable), kCancelled
/// (stop requested; finished work is kept), kIo and kNoSpace (the output cannot be written;
/// likewise), kLimitExceeded (the memory limit is below what the smallest settings need). Finding
/// no model is not an error: the report tells why for each image.
[[nodiscard]] Result<ReconstructionSummary> reconstruct(const PhotoSet& photos,
                                                        const ReconstructionPlaces& places,
                                                        const ReconstructionOptions& options,
                                                        const Clock& clock,
                                                        ProgressListener& listener,
                                                        const std::stop_token& stop);

/// The same into `output`/model, `output`/work and `output`/timings.json.
[[nodiscard]] Result<ReconstructionSummary> reconstruct(const PhotoSet& photos,
                                                        const std::filesystem::path& output,
                                                        const ReconstructionOptions& options,
                                                        const Clock& clock,
                                                        ProgressListener& listener,
                                                        const std::stop_token& stop);

/// The stages after mapping on a model that exists (ours or another program's, its photographs by
/// the names of its images): adds their results to `output`/model, which is made when missing.
/// Errors as above; kInsufficientData also when the model has no points.
[[nodiscard]] Result<ReconstructionSummary> continue_model(const ExistingModel& model,
                                                           const PhotoSet& photos,
                                                           const std::filesystem::path& output,
                                                           const ReconstructionOptions& options,
                                                           const Clock& clock,
                                                           ProgressListener& listener,
                                                           const std::stop_token& stop);

}  // namespace trigmesh
