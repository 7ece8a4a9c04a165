#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/base/result.hpp"
#include "firmware/pipeline/camera_groups.hpp"
#include "firmware/pipeline/progress.hpp"
#include "firmware/pipeline/report.hpp"
#include "sfm/features/features.hpp"
#include "sfm/mapping/mapper.hpp"
#include "sfm/matching/pair_selection.hpp"

namespace trigmesh {

/// The photographs of one reconstruction. Whatever they come from (folder, list, recording) looks
/// like this here.
struct PhotoSet {
  std::vector<std::string> names;  ///< unique, in input order
  bool ordered = false;            ///< neighbours in the list are neighbours in time
  std::string description;         ///< for the report, e.g. "photo folder, 25 photographs"
  /// The encoded bytes (JPEG or PNG) of a photograph. Thread-safe.
  std::function<Result<std::vector<std::uint8_t>>(std::size_t)> read;
};

/// Settings of a reconstruction.
struct ReconstructionOptions {
  FeatureKind feature_kind = FeatureKind::kSift;
  FeatureOptions features;
  PairMode pair_mode = PairMode::kAuto;
  GroupingMode grouping = GroupingMode::kAuto;
  std::vector<Camera> cameras;  ///< given intrinsics; empty when none are known
  MapperOptions mapper;
  /// Threads that work, [1, 256]. The result does not depend on it.
  int num_threads = 1;
  /// Most memory to use, bytes; 0 for no limit. Quality is lowered in declared steps to keep it.
  std::uint64_t memory_limit_bytes = 0;
  std::uint64_t seed = 0;
  std::string software_version;

  [[nodiscard]] Result<> validate() const;
};

/// Time spent in each stage, for timings.json; never part of the model.
struct StageTime {
  Stage stage = Stage::kExtract;
  std::chrono::nanoseconds duration{};
};

/// What a finished reconstruction says of itself.
struct ReconstructionSummary {
  ReconstructionReport report;
  std::vector<StageTime> times;
};

/// Photographs in, cameras and coloured cloud out: extracts, matches, maps, and writes
/// `output`/model (in one step: it is either the old or the new model, never half of one),
/// `output`/timings.json, and while it works `output`/work, from which an interrupted call with the
/// same photographs and options goes on.
///
/// Errors: kInvalidArgument (options), kInsufficientData (no photograph, none readable), kCancelled
/// (stop requested; finished work is kept), kIo and kNoSpace (the output cannot be written;
/// likewise), kLimitExceeded (the memory limit is below what the smallest settings need). Finding
/// no model is not an error: the report tells why for each image.
[[nodiscard]] Result<ReconstructionSummary> reconstruct(const PhotoSet& photos,
                                                        const std::filesystem::path& output,
                                                        const ReconstructionOptions& options,
                                                        const Clock& clock,
                                                        ProgressListener& listener,
                                                        const std::stop_token& stop);

}  // namespace trigmesh
