#include "firmware/pipeline/sequence_matching.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/matchable_image.hpp"
#include "firmware/pipeline/matching_stage.hpp"

namespace trigmesh {

namespace {

// A first map is tried when so many keyframes wait for one: fewer seldom have parallax, and an
// unknown focal length needs more of them to be guessed well.
constexpr std::size_t kFirstMap = 6;
constexpr std::size_t kFirstMapOfUnknownLens = 12;
// ... and again after so many more.
constexpr std::size_t kNextTry = 3;

std::uint64_t key_of(const SequenceMatchingOptions& options) {
  return content_hash(fmt::format("{} {} {} {} {} {} {}",
                                  options.mapper.seed,
                                  options.window,
                                  options.preemptive_features,
                                  options.min_preemptive_matches,
                                  options.far_spacing,
                                  options.max_far_pairs,
                                  options.max_disagreement_deg));
}

std::uint64_t key_of(const ExtractedImage& image,
                     const CameraGroup& group,
                     CameraId camera,
                     std::uint64_t before) {
  if (!image.features) {
    return content_hash("unreadable", before);
  }
  std::string text = fmt::format(
      "{} {} {}", image.features->content, index(camera), static_cast<int>(group.knowledge));
  for (const double value : group.camera.intrinsics()) {
    text += fmt::format(" {}", value);
  }
  return content_hash(image.features->features.descriptors, content_hash(text, before));
}

std::string checkpoint_name(std::size_t frame) {
  return fmt::format("sequence-{:06}", frame);
}

}  // namespace

SequenceMatchingOptions walk_matching_options(const ReconstructionOptions& options) {
  SequenceMatchingOptions matching;
  matching.mapper = options.mapper;
  matching.mapper.seed = options.seed;
  return matching;
}

Result<SequenceMatcher> SequenceMatcher::create(const SequenceMatchingOptions& options,
                                                Executor& executor,
                                                const CheckpointFolder& checkpoints) {
  auto chain_executor = std::make_unique<SerialExecutor>();
  TM_ASSIGN_OR_RETURN(Mapper chain, Mapper::create(options.mapper, *chain_executor));
  return SequenceMatcher(
      options, executor, checkpoints, std::move(chain_executor), std::move(chain));
}

SequenceMatcher::SequenceMatcher(const SequenceMatchingOptions& options,
                                 Executor& executor,
                                 const CheckpointFolder& checkpoints,
                                 std::unique_ptr<Executor> chain_executor,
                                 Mapper chain)
    : options_(options),
      executor_(&executor),
      checkpoints_(&checkpoints),
      key_(key_of(options)),
      chain_executor_(std::move(chain_executor)),
      chain_(std::move(chain)) {
  matching_.verification.seed = static_cast<int>(options.mapper.seed & 0x7fffffffU);
}

Result<std::span<const PairRecord>> SequenceMatcher::add(const SequenceKeyframe& keyframe) {
  enter(keyframe);
  const std::size_t frame = frames_.size() - 1;
  if (!frames_[frame].is_judged) {
    TM_RETURN_IF_ERROR(prepare());
    TM_RETURN_IF_ERROR(follow_until(frame));
    compare(frame, *executor_);
    TM_RETURN_IF_ERROR(follow_until(frame + 1));
  }
  return frames_[frame].pairs;
}

Result<> SequenceMatcher::add_block(std::span<const SequenceKeyframe> keyframes,
                                    const std::function<void()>& compared) {
  const std::size_t begin = frames_.size();
  std::vector<std::size_t> missing;
  for (const SequenceKeyframe& keyframe : keyframes) {
    enter(keyframe);
    if (frames_.back().is_judged) {
      compared();
    } else {
      missing.push_back(frames_.size() - 1);
    }
  }
  if (missing.empty()) {
    return {};
  }
  TM_RETURN_IF_ERROR(prepare());
  Result<> followed;
  executor_->for_each_index(missing.size() + 1, [&](std::size_t i) {
    if (i == 0) {
      followed = follow_until(begin);
      return;
    }
    SerialExecutor serial;
    compare(missing[i - 1], serial);
    compared();
  });
  return followed;
}

Result<std::vector<PairRecord>> SequenceMatcher::all_pairs() {
  const auto last =
      std::find_if(frames_.rbegin(), frames_.rend(), [](const Frame& f) { return !f.is_judged; });
  TM_RETURN_IF_ERROR(follow_until(static_cast<std::size_t>(frames_.rend() - last)));
  std::vector<PairRecord> pairs;
  for (const Frame& frame : frames_) {
    pairs.insert(pairs.end(), frame.pairs.begin(), frame.pairs.end());
  }
  return pairs;
}

Result<> SequenceMatcher::catch_up() {
  TM_RETURN_IF_ERROR(prepare());
  return follow_until(frames_.size());
}

SequenceFollowing SequenceMatcher::following() const {
  TM_CHECK(!frames_.empty() && in_chain_ == frames_.size());
  if (chain_.registered_count() == 0) {
    return SequenceFollowing::kWaiting;
  }
  const Frame& last = frames_.back();
  return last.matchable && chain_.is_registered(last.in_chain) ? SequenceFollowing::kTracked
                                                               : SequenceFollowing::kLost;
}

void SequenceMatcher::enter(const SequenceKeyframe& keyframe) {
  key_ = key_of(*keyframe.image, keyframe.group, keyframe.camera, key_);
  frames_.push_back({keyframe, key_});
  frames_.back().is_judged = load(frames_.size() - 1);
}

/// What an earlier run found of the keyframe; false: nothing.
bool SequenceMatcher::load(std::size_t frame) {
  const auto payload = checkpoints_->load(checkpoint_name(frame), frames_[frame].key);
  if (!payload) {
    return false;
  }
  auto decoded = decode_pairs(*payload);
  if (decoded) {
    frames_[frame].pairs = *std::move(decoded);
  }
  return decoded.has_value();
}

/// All keyframes so far can be compared.
Result<> SequenceMatcher::prepare() {
  std::vector<Result<>> prepared(frames_.size() - prepared_);
  executor_->for_each_index(prepared.size(), [&](std::size_t i) {
    Frame& frame = frames_[prepared_ + i];
    if (!frame.keyframe.image->features) {
      return;
    }
    auto matchable = matchable_image(*frame.keyframe.image->features, frame.keyframe.group);
    if (matchable) {
      frame.matchable = *std::move(matchable);
    } else {
      prepared[i] = tl::unexpected<Error>(matchable.error());
    }
  });
  for (const Result<>& one : prepared) {
    TM_RETURN_IF_ERROR(one);
  }
  prepared_ = frames_.size();
  return {};
}

/// Finds its pairs; nothing of it depends on the chain map.
void SequenceMatcher::compare(std::size_t frame, Executor& executor) {
  const std::vector<std::size_t> near = neighbours_of(frame);
  const std::vector<PairRecord> near_pairs = match(near, frame, executor);
  std::vector<PairRecord>& pairs = frames_[frame].pairs;
  pairs = match(look_alikes_of(frame, near.empty() ? 0 : near.front(), executor), frame, executor);
  pairs.insert(pairs.end(), near_pairs.begin(), near_pairs.end());
}

std::vector<PairRecord> SequenceMatcher::match(std::span<const std::size_t> partners,
                                               std::size_t frame,
                                               Executor& executor) const {
  std::vector<PairRecord> pairs(partners.size());
  executor.for_each_index(partners.size(), [&](std::size_t i) {
    pairs[i] = {{id_of<ViewId>(partners[i]), id_of<ViewId>(frame)},
                match_pair(*frames_[partners[i]].matchable, *frames_[frame].matchable, matching_)};
  });
  std::erase_if(pairs, [](const PairRecord& record) { return record.geometry.candidates == 0; });
  return pairs;
}

Result<> SequenceMatcher::follow_until(std::size_t end) {
  while (in_chain_ < end) {
    TM_RETURN_IF_ERROR(follow(in_chain_));
  }
  return {};
}

/// The next keyframe into the chain map, which judges its far pairs where no earlier run did.
Result<> SequenceMatcher::follow(std::size_t number) {
  Frame& frame = frames_[number];
  enter_chain(frame);
  const std::span<PairRecord> pairs = frame.pairs;
  const std::size_t far_count = far_count_of(number);
  add_to_chain(pairs.subspan(far_count));
  if (!frame.is_judged) {
    judge(pairs.first(far_count));
  }
  add_to_chain(pairs.first(far_count));
  grow(frame);
  if (std::exchange(frame.is_judged, true)) {
    return {};
  }
  return checkpoints_->save(checkpoint_name(number), frame.key, encode_pairs(frame.pairs));
}

/// How many of its pairs come before those with its neighbours.
std::size_t SequenceMatcher::far_count_of(std::size_t frame) const {
  const std::vector<std::size_t> near = neighbours_of(frame);
  const std::vector<PairRecord>& pairs = frames_[frame].pairs;
  const auto first_near = std::find_if(pairs.begin(), pairs.end(), [&](const PairRecord& record) {
    return !near.empty() && index(record.pair.first) >= near.front();
  });
  return static_cast<std::size_t>(first_near - pairs.begin());
}

void SequenceMatcher::enter_chain(Frame& frame) {
  ++in_chain_;
  if (!frame.matchable) {
    return;
  }
  const auto& [image, group, camera] = frame.keyframe;
  if (index(camera) == cameras_in_chain_) {
    chain_.add_camera(group.camera, group.knowledge);
    ++cameras_in_chain_;
  }
  frame.in_chain = chain_.add_image({{}, camera, image->features->features.keypoints});
}

/// The readable keyframes just before it, ascending.
std::vector<std::size_t> SequenceMatcher::neighbours_of(std::size_t frame) const {
  std::vector<std::size_t> neighbours;
  for (std::size_t i = frame; i-- > 0 && neighbours.size() < options_.window;) {
    if (frames_[i].matchable && frames_[frame].matchable) {
      neighbours.push_back(i);
    }
  }
  std::reverse(neighbours.begin(), neighbours.end());
  return neighbours;
}

/// Of the keyframes before `end`, those of which most coarse features match (preemptive matching:
/// Wu, Towards linear-time incremental structure from motion, 3DV 2013, section 3), some places
/// apart from each other, ascending.
std::vector<std::size_t> SequenceMatcher::look_alikes_of(std::size_t frame,
                                                         std::size_t end,
                                                         Executor& executor) const {
  std::vector<std::pair<std::size_t, std::size_t>> ranked(end);  // (matches, keyframe)
  executor.for_each_index(end, [&](std::size_t i) {
    ranked[i] = {0, i};
    if (frames_[i].matchable) {
      ranked[i].first = match_descriptors(frames_[i].matchable->index,
                                          frames_[frame].matchable->index,
                                          {.max_features = options_.preemptive_features})
                            .size();
    }
  });
  std::stable_sort(
      ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::size_t> chosen;
  for (const auto& candidate : ranked) {
    const std::size_t matches = candidate.first;
    const std::size_t other = candidate.second;
    if (matches < options_.min_preemptive_matches || chosen.size() == options_.max_far_pairs) {
      break;
    }
    const bool stands_apart = std::none_of(chosen.begin(), chosen.end(), [&](std::size_t taken) {
      return std::max(taken, other) - std::min(taken, other) < options_.far_spacing;
    });
    if (stands_apart) {
      chosen.push_back(other);
    }
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

/// Strongest pairs first; then the keyframe gets its pose, if it fits.
void SequenceMatcher::add_to_chain(std::span<const PairRecord> pairs) {
  for (const std::size_t i : strongest_first(pairs)) {
    const PairRecord& record = pairs[i];
    chain_.add_pair(
        {frames_[index(record.pair.first)].in_chain, frames_[index(record.pair.second)].in_chain},
        record.geometry);
  }
  if (!pairs.empty()) {
    chain_.track();
  }
}

void SequenceMatcher::judge(std::span<PairRecord> pairs) const {
  for (PairRecord& record : pairs) {
    if (!shows_one_scene(record.geometry.kind)) {
      continue;
    }
    const auto disagreement_deg = chain_.disagreement_deg(
        {frames_[index(record.pair.first)].in_chain, frames_[index(record.pair.second)].in_chain},
        record.geometry.inliers);
    if (disagreement_deg && *disagreement_deg > options_.max_disagreement_deg) {
      record.geometry.kind = TwoViewKind::kLookAlike;
    }
  }
}

/// Begins a chain map, and refines those that are, when keyframes wait in vain.
void SequenceMatcher::grow(const Frame& frame) {
  if (!frame.matchable || chain_.is_registered(frame.in_chain)) {
    return;
  }
  ++without_pose_;
  const bool is_first = chain_.registered_count() == 0;
  const bool is_known = frame.keyframe.group.knowledge != IntrinsicsKnowledge::kUnknown;
  if (without_pose_ < (is_first && !is_known ? kFirstMapOfUnknownLens : kFirstMap)) {
    return;
  }
  while (chain_.step().kind != StepKind::kNothing) {
  }
  without_pose_ = chain_.is_registered(frame.in_chain) ? 0 : without_pose_ - kNextTry;
}

}  // namespace trigmesh
