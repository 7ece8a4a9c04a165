#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "firmware/pipeline/camera_groups.hpp"
#include "firmware/pipeline/checkpoint.hpp"
#include "firmware/pipeline/extraction_stage.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "sfm/mapping/image_store.hpp"
#include "sfm/mapping/mapper.hpp"
#include "sfm/matching/pair_matching.hpp"

namespace trigmesh {

/// How the keyframes of a walk are compared while they come.
struct SequenceMatchingOptions {
  /// Of the chain map, by which look-alike places are recognised; its seed is of all sampling.
  MapperOptions mapper;
  /// So many readable keyframes before each are always compared with it, > 0.
  std::size_t window = 8;
  /// Of the earlier ones, those of which at least so many of the coarsest features match, ...
  std::size_t preemptive_features = 400;
  std::size_t min_preemptive_matches = 4;
  /// ... the best of them, this many places apart or more, at most so many.
  std::size_t far_spacing = 3;
  std::size_t max_far_pairs = 10;
  /// A pair far back in time that disagrees with the chain map by more is a look-alike, degrees.
  double max_disagreement_deg = 10.0;
};

/// As reconstruct() compares the keyframes of a walk.
[[nodiscard]] SequenceMatchingOptions walk_matching_options(const ReconstructionOptions& options);

/// How a keyframe stands to the chain map of those before it.
enum class SequenceFollowing {
  kWaiting,  ///< there is no map yet: no parallax so far
  kTracked,  ///< its pose is known
  kLost,     ///< there is a map, but the keyframe does not fit it, or has no features
};

/// Compares each keyframe of a walk with those before it, as it comes: its neighbours in time, and
/// earlier ones that look alike, which close loops. A chain map grows from the neighbours; a loop
/// that contradicts it is a look-alike place and counts for nothing (TwoViewKind::kLookAlike: the
/// time-order veto). What it finds of a keyframe depends on that one and those before it alone, so
/// that a walk gives the same pairs while it is taken and afterwards. Each finished keyframe is a
/// checkpoint. Single thread (the executor may use more).
class SequenceMatcher {
 public:
  /// `executor` and `checkpoints` outlive it.
  [[nodiscard]] static Result<SequenceMatcher> create(const SequenceMatchingOptions& options,
                                                      Executor& executor,
                                                      const CheckpointFolder& checkpoints);

  /// The next keyframe; `image` outlives the matcher. `camera` is its group among those of the
  /// keyframes so far, in the order of their first keyframes. Returns its pairs with earlier ones,
  /// those without any candidate left out, first ascending. kIo, kNoSpace of the checkpoints.
  [[nodiscard]] Result<std::span<const PairRecord>> add(const ExtractedImage& image,
                                                        const CameraGroup& group,
                                                        CameraId camera);

  /// Puts what came from checkpoints into the chain map. kInvalidArgument: features that cannot be
  /// compared.
  [[nodiscard]] Result<> catch_up();

  /// How the keyframe added last stands to the chain map. Precondition: there is one, and the
  /// matcher has caught up.
  [[nodiscard]] SequenceFollowing following() const;

  /// Keyframes with a pose in the chain map.
  [[nodiscard]] std::size_t tracked_count() const { return chain_.registered_count(); }

 private:
  struct Keyframe {
    const ExtractedImage* image = nullptr;
    CameraGroup group;
    CameraId camera{};
    std::vector<PairRecord> pairs;
    std::optional<MatchableImage> matchable{};  ///< once it is in the chain map
    ViewId in_chain{};
  };

  SequenceMatcher(const SequenceMatchingOptions& options,
                  Executor& executor,
                  const CheckpointFolder& checkpoints,
                  Mapper chain);

  [[nodiscard]] std::string checkpoint_name() const;
  [[nodiscard]] std::optional<std::vector<PairRecord>> stored_pairs() const;
  [[nodiscard]] Result<> enter_chain(std::size_t frame);
  [[nodiscard]] Result<> absorb_until(std::size_t end);
  void absorb(std::size_t frame);
  void compare(std::size_t frame);
  [[nodiscard]] std::vector<PairRecord> match(std::span<const std::size_t> partners,
                                              std::size_t frame) const;
  [[nodiscard]] std::vector<std::size_t> neighbours_of(std::size_t frame) const;
  [[nodiscard]] std::vector<std::size_t> look_alikes_of(std::size_t frame, std::size_t end) const;
  void add_to_chain(std::span<const PairRecord> pairs);
  void judge(std::span<PairRecord> pairs) const;
  void grow(std::size_t frame);

  SequenceMatchingOptions options_;
  PairMatchingOptions matching_;
  Executor* executor_;
  const CheckpointFolder* checkpoints_;
  std::uint64_t key_;  ///< of all keyframes so far
  std::vector<Keyframe> frames_;
  std::size_t in_chain_ = 0;  ///< keyframes that the chain map has been told of
  std::size_t cameras_in_chain_ = 0;
  std::size_t without_pose_ = 0;  ///< keyframes, since the chain map was last grown
  Mapper chain_;
};

}  // namespace trigmesh
