#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/checkpoint.hpp"
#include "firmware/pipeline/extraction_stage.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "firmware/pipeline/sequence_matching.hpp"
#include "firmware/pipeline/worker_pool.hpp"

namespace trigmesh {

/// What is known of a walk after a photograph.
struct WalkState {
  SequenceFollowing following = SequenceFollowing::kWaiting;  ///< of the photograph
  std::size_t photographs = 0;                                ///< so far
  std::size_t tracked = 0;                                    ///< of these, with a pose
  /// One of its matches leads far back: the walk came around.
  bool closes_loop = false;
};

/// Does the work on a walk while it is taken, photograph by photograph: features, matches, a map of
/// neighbours. Finished pieces lie in the work folder, under the names and keys under which
/// reconstruct() looks for them, so that it finds its first stages done; it gives the same bytes
/// without. Threads as told in the options; add() is called from one thread.
class WalkFollower {
 public:
  /// `options` as for reconstruct(); what depends on the number of photographs is planned for
  /// kPlannedPhotographs. kInvalidArgument, kIo, kNoSpace, kLimitExceeded.
  [[nodiscard]] static Result<std::unique_ptr<WalkFollower>> create(
      const ReconstructionOptions& options,
      const std::filesystem::path& work,
      const std::stop_token& stop);

  /// The next photograph; its file stays where it is. One that cannot be read is refused, not an
  /// error. kCancelled: `stop`; kIo, kNoSpace: the work folder; kInvalidArgument: the given camera
  /// does not fit.
  [[nodiscard]] Result<WalkState> add(const std::string& name, const std::filesystem::path& file);

  static constexpr std::size_t kPlannedPhotographs = 200;

 private:
  WalkFollower(const ReconstructionOptions& options,
               CheckpointFolder checkpoints,
               const std::stop_token& stop);

  [[nodiscard]] Result<WalkState> follow(std::size_t photo);
  [[nodiscard]] Result<CameraGroups> groups_so_far() const;

  const ReconstructionOptions options_;
  const CheckpointFolder checkpoints_;
  WorkerPool pool_;
  PhotoSet photos_;
  std::vector<std::filesystem::path> files_;
  std::unique_ptr<PhotoExtractor> extractor_;
  DuplicateFilter duplicates_;
  std::deque<ExtractedImage> images_;  ///< they stay where they are: the matcher borrows them
  std::unique_ptr<SequenceMatcher> matcher_;
};

}  // namespace trigmesh
