#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
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

/// A keyframe of a walk. `camera` is its group among those of the keyframes so far, in the order of
/// their first keyframes.
struct SequenceKeyframe {
  const ExtractedImage* image = nullptr;  ///< outlives the matcher
  CameraGroup group;
  CameraId camera{};
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

  /// The next keyframe. Returns its pairs with earlier ones, those without any candidate left out,
  /// first ascending. kIo, kNoSpace of the checkpoints; kInvalidArgument: features that cannot be
  /// compared.
  [[nodiscard]] Result<std::span<const PairRecord>> add(const SequenceKeyframe& keyframe);

  /// The next keyframes, when they are all there: compared with each other and with earlier ones
  /// while the chain map follows the earlier ones. `compared` is called for each, on any thread.
  /// Their pairs are known after all_pairs(). Errors as above.
  [[nodiscard]] Result<> add_block(std::span<const SequenceKeyframe> keyframes,
                                   const std::function<void()>& compared);

  /// Of all keyframes so far, in their order. Errors as above.
  [[nodiscard]] Result<std::vector<PairRecord>> all_pairs();

  /// Puts what came from checkpoints into the chain map. kInvalidArgument: features that cannot be
  /// compared.
  [[nodiscard]] Result<> catch_up();

  /// How the keyframe added last stands to the chain map. Precondition: there is one, and the
  /// matcher has caught up.
  [[nodiscard]] SequenceFollowing following() const;

  /// Keyframes with a pose in the chain map.
  [[nodiscard]] std::size_t tracked_count() const { return chain_.registered_count(); }

 private:
  struct Frame {
    SequenceKeyframe keyframe;
    std::uint64_t key = 0;                      ///< of it and all before it
    std::optional<MatchableImage> matchable{};  ///< once something is compared with it
    std::vector<PairRecord> pairs{};            ///< with places that look alike, with neighbours
    bool is_judged = false;                     ///< by the chain map, now or in an earlier run
    ViewId in_chain{};
  };

  SequenceMatcher(const SequenceMatchingOptions& options,
                  Executor& executor,
                  const CheckpointFolder& checkpoints,
                  std::unique_ptr<Executor> chain_executor,
                  Mapper chain);

  void enter(const SequenceKeyframe& keyframe);
  [[nodiscard]] bool load(std::size_t frame);
  [[nodiscard]] Result<> prepare();
  void compare(std::size_t frame, Executor& executor);
  [[nodiscard]] std::vector<PairRecord> match(std::span<const std::size_t> partners,
                                              std::size_t frame,
                                              Executor& executor) const;
  [[nodiscard]] std::vector<std::size_t> neighbours_of(std::size_t frame) const;
  [[nodiscard]] std::vector<std::size_t> look_alikes_of(std::size_t frame,
                                                        std::size_t end,
                                                        Executor& executor) const;
  [[nodiscard]] Result<> follow_until(std::size_t end);
  [[nodiscard]] Result<> follow(std::size_t number);
  [[nodiscard]] std::size_t far_count_of(std::size_t frame) const;
  void enter_chain(Frame& frame);
  void add_to_chain(std::span<const PairRecord> pairs);
  void judge(std::span<PairRecord> pairs) const;
  void grow(const Frame& frame);

  SequenceMatchingOptions options_;
  PairMatchingOptions matching_;
  Executor* executor_;
  const CheckpointFolder* checkpoints_;
  std::uint64_t key_;  ///< of all keyframes so far
  std::vector<Frame> frames_;
  std::size_t prepared_ = 0;  ///< keyframes that something can be compared with
  std::size_t in_chain_ = 0;  ///< keyframes that the chain map has been told of
  std::size_t cameras_in_chain_ = 0;
  std::size_t without_pose_ = 0;  ///< keyframes, since the chain map was last grown
  /// One thread: the others compare meanwhile.
  std::unique_ptr<Executor> chain_executor_;
  Mapper chain_;
};

}  // namespace trigmesh
