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
  TM_ASSIGN_OR_RETURN(Mapper chain, Mapper::create(options.mapper, executor));
  return SequenceMatcher(options, executor, checkpoints, std::move(chain));
}

SequenceMatcher::SequenceMatcher(const SequenceMatchingOptions& options,
                                 Executor& executor,
                                 const CheckpointFolder& checkpoints,
                                 Mapper chain)
    : options_(options),
      executor_(&executor),
      checkpoints_(&checkpoints),
      key_(key_of(options)),
      chain_(std::move(chain)) {
  matching_.verification.seed = static_cast<int>(options.mapper.seed & 0x7fffffffU);
}

Result<std::span<const PairRecord>> SequenceMatcher::add(const ExtractedImage& image,
                                                         const CameraGroup& group,
                                                         CameraId camera) {
  key_ = key_of(image, group, camera, key_);
  frames_.push_back({&image, group, camera, {}});
  const std::size_t frame = frames_.size() - 1;
  if (auto stored = stored_pairs()) {
    frames_.back().pairs = *std::move(stored);
    return frames_.back().pairs;
  }
  TM_RETURN_IF_ERROR(absorb_until(frame));
  TM_RETURN_IF_ERROR(enter_chain(frame));
  compare(frame);
  TM_RETURN_IF_ERROR(
      checkpoints_->save(checkpoint_name(), key_, encode_pairs(frames_.back().pairs)));
  return frames_.back().pairs;
}

Result<> SequenceMatcher::catch_up() {
  return absorb_until(frames_.size());
}

Result<> SequenceMatcher::absorb_until(std::size_t end) {
  while (in_chain_ < end) {
    TM_RETURN_IF_ERROR(enter_chain(in_chain_));
    absorb(in_chain_ - 1);
  }
  return {};
}

SequenceFollowing SequenceMatcher::following() const {
  TM_CHECK(!frames_.empty() && in_chain_ == frames_.size());
  if (chain_.registered_count() == 0) {
    return SequenceFollowing::kWaiting;
  }
  const Keyframe& last = frames_.back();
  return last.matchable && chain_.is_registered(last.in_chain) ? SequenceFollowing::kTracked
                                                               : SequenceFollowing::kLost;
}

std::string SequenceMatcher::checkpoint_name() const {
  return fmt::format("sequence-{:06}", frames_.size() - 1);
}

std::optional<std::vector<PairRecord>> SequenceMatcher::stored_pairs() const {
  const auto payload = checkpoints_->load(checkpoint_name(), key_);
  if (!payload) {
    return std::nullopt;
  }
  auto decoded = decode_pairs(*payload);
  return decoded ? std::optional(*std::move(decoded)) : std::nullopt;
}

/// The next keyframe into the chain map, without any pair.
Result<> SequenceMatcher::enter_chain(std::size_t frame) {
  Keyframe& keyframe = frames_[frame];
  ++in_chain_;
  if (!keyframe.image->features) {
    return {};
  }
  TM_ASSIGN_OR_RETURN(keyframe.matchable,
                      matchable_image(*keyframe.image->features, keyframe.group));
  if (index(keyframe.camera) == cameras_in_chain_) {
    chain_.add_camera(keyframe.group.camera, keyframe.group.knowledge);
    ++cameras_in_chain_;
  }
  keyframe.in_chain =
      chain_.add_image({{}, keyframe.camera, keyframe.image->features->features.keypoints});
  return {};
}

/// What is known of a keyframe does to the chain map what it did when it was found.
void SequenceMatcher::absorb(std::size_t frame) {
  const std::vector<std::size_t> near = neighbours_of(frame);
  std::vector<PairRecord>& pairs = frames_[frame].pairs;
  const auto first_near = std::find_if(pairs.begin(), pairs.end(), [&](const PairRecord& record) {
    return !near.empty() && index(record.pair.first) >= near.front();
  });
  add_to_chain(std::span(first_near, pairs.end()));
  add_to_chain(std::span(pairs.begin(), first_near));
  grow(frame);
}

void SequenceMatcher::compare(std::size_t frame) {
  const std::vector<std::size_t> near = neighbours_of(frame);
  const std::vector<PairRecord> near_pairs = match(near, frame);
  add_to_chain(near_pairs);
  std::vector<PairRecord>& pairs = frames_[frame].pairs;
  pairs = match(look_alikes_of(frame, near.empty() ? 0 : near.front()), frame);
  judge(pairs);
  add_to_chain(pairs);
  pairs.insert(pairs.end(), near_pairs.begin(), near_pairs.end());
  grow(frame);
}

std::vector<PairRecord> SequenceMatcher::match(std::span<const std::size_t> partners,
                                               std::size_t frame) const {
  std::vector<PairRecord> pairs(partners.size());
  executor_->for_each_index(partners.size(), [&](std::size_t i) {
    pairs[i] = {{id_of<ViewId>(partners[i]), id_of<ViewId>(frame)},
                match_pair(*frames_[partners[i]].matchable, *frames_[frame].matchable, matching_)};
  });
  std::erase_if(pairs, [](const PairRecord& record) { return record.geometry.candidates == 0; });
  return pairs;
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
std::vector<std::size_t> SequenceMatcher::look_alikes_of(std::size_t frame, std::size_t end) const {
  std::vector<std::pair<std::size_t, std::size_t>> ranked(end);  // (matches, keyframe)
  executor_->for_each_index(end, [&](std::size_t i) {
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
void SequenceMatcher::grow(std::size_t frame) {
  const Keyframe& keyframe = frames_[frame];
  if (!keyframe.matchable || chain_.is_registered(keyframe.in_chain)) {
    return;
  }
  ++without_pose_;
  const bool is_first = chain_.registered_count() == 0;
  const bool is_known = keyframe.group.knowledge != IntrinsicsKnowledge::kUnknown;
  if (without_pose_ < (is_first && !is_known ? kFirstMapOfUnknownLens : kFirstMap)) {
    return;
  }
  while (chain_.step().kind != StepKind::kNothing) {
  }
  without_pose_ = chain_.is_registered(keyframe.in_chain) ? 0 : without_pose_ - kNextTry;
}

}  // namespace trigmesh
