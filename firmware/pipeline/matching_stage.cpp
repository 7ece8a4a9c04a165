#include "firmware/pipeline/matching_stage.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "firmware/base/binary_stream.hpp"
#include "firmware/base/check.hpp"
#include "firmware/pipeline/matchable_image.hpp"
#include "firmware/pipeline/sequence_matching.hpp"

namespace trigmesh {

namespace {

/// Keyframes of a walk that are compared while the chain map follows as many before them.
constexpr std::size_t kWalkBlock = 16;

constexpr const char* kCheckpoint = "pairs";

std::uint64_t key_of(const std::vector<ExtractedImage>& images,
                     const CameraGroups& cameras,
                     const MatchingStageOptions& options) {
  std::string text =
      fmt::format("{} {} {}", static_cast<int>(options.pair_mode), options.ordered, options.seed);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const CameraGroup& group = cameras.groups[index(cameras.group_of_image[i])];
    const FeatureSet* features = images[i].features ? &images[i].features->features : nullptr;
    text += fmt::format("\n{} {} {}",
                        images[i].features ? images[i].features->content : 0,
                        features != nullptr ? content_hash(features->descriptors) : 0,
                        static_cast<int>(group.knowledge));
    for (const double value : group.camera.intrinsics()) {
      text += fmt::format(" {}", value);
    }
  }
  return content_hash(text);
}

/// All images; an unreadable one has no features and so is in no pair.
Result<std::vector<MatchableImage>> prepare_all(const std::vector<ExtractedImage>& images,
                                                const CameraGroups& cameras) {
  // The index of an image borrows its descriptors, so nothing here may be a copy.
  static const ImageFeatures nothing;
  std::vector<MatchableImage> result;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const CameraGroup& group = cameras.groups[index(cameras.group_of_image[i])];
    TM_ASSIGN_OR_RETURN(MatchableImage image,
                        matchable_image(images[i].features ? *images[i].features : nothing, group));
    result.push_back(std::move(image));
  }
  return result;
}

Result<std::vector<ImagePair>> choose_pairs(const std::vector<MatchableImage>& images,
                                            const MatchingStageOptions& options,
                                            const StageContext& context) {
  context.listener.on_progress({Stage::kSelectPairs, 0, 0});
  std::vector<DescriptorIndex> indexes;
  for (const MatchableImage& image : images) {
    indexes.push_back(image.index);
  }
  PairSelectionOptions selection;
  selection.mode = options.pair_mode;
  selection.order = options.ordered ? ImageOrder::kSequence : ImageOrder::kUnordered;
  return select_pairs(indexes, selection, context.executor);
}

}  // namespace

std::vector<std::uint8_t> encode_pairs(const std::vector<PairRecord>& pairs) {
  BinaryWriter out;
  out.value(static_cast<std::uint64_t>(pairs.size()));
  for (const PairRecord& record : pairs) {
    out.value(record.pair);
    out.value(static_cast<std::uint32_t>(record.geometry.kind));
    for (const double entry : record.geometry.fundamental.reshaped()) {
      out.value(entry);
    }
    out.value(static_cast<std::uint64_t>(record.geometry.candidates));
    out.value(static_cast<std::uint64_t>(record.geometry.homography_inliers));
    out.items(record.geometry.inliers);
  }
  return out.take();
}

Result<std::vector<PairRecord>> decode_pairs(std::span<const std::uint8_t> bytes) {
  BinaryReader in(bytes);
  const auto count = in.value<std::uint64_t>();
  std::vector<PairRecord> pairs;
  for (std::uint64_t i = 0; i < count && in.ok(); ++i) {
    PairRecord record;
    record.pair = in.value<ImagePair>();
    const auto kind = in.value<std::uint32_t>();
    for (double& entry : record.geometry.fundamental.reshaped()) {
      entry = in.value<double>();
    }
    record.geometry.candidates = static_cast<std::size_t>(in.value<std::uint64_t>());
    record.geometry.homography_inliers = static_cast<std::size_t>(in.value<std::uint64_t>());
    record.geometry.inliers = in.items<FeatureMatch>();
    if (kind > static_cast<std::uint32_t>(TwoViewKind::kLookAlike)) {
      return fail(ErrorCode::kCorruptData, "cannot read stored pairs: unknown kind {}", kind);
    }
    record.geometry.kind = static_cast<TwoViewKind>(kind);
    pairs.push_back(std::move(record));
  }
  if (!in.complete()) {
    return fail(ErrorCode::kCorruptData, "cannot read stored pairs: the record contradicts itself");
  }
  return pairs;
}

Result<std::vector<PairRecord>> match_photos(const std::vector<ExtractedImage>& images,
                                             const CameraGroups& cameras,
                                             const MatchingStageOptions& options,
                                             const StageContext& context) {
  const std::uint64_t key = key_of(images, cameras, options);
  if (const auto payload = context.checkpoints.load(kCheckpoint, key)) {
    if (auto stored = decode_pairs(*payload)) {
      return std::move(*stored);
    }
  }
  TM_ASSIGN_OR_RETURN(const std::vector<MatchableImage> matchable, prepare_all(images, cameras));
  TM_ASSIGN_OR_RETURN(const std::vector<ImagePair> chosen,
                      choose_pairs(matchable, options, context));
  PairMatchingOptions matching;
  matching.verification.seed = static_cast<int>(options.seed & 0x7fffffffU);
  std::vector<PairRecord> pairs(chosen.size());
  StageProgress progress(context, Stage::kMatch, chosen.size());
  context.executor.for_each_index(chosen.size(), [&](std::size_t i) {
    if (context.stop.stop_requested()) {
      return;
    }
    const ImagePair pair = chosen[i];
    pairs[i] = {pair,
                match_pair(matchable[index(pair.first)], matchable[index(pair.second)], matching)};
    progress.advance();
  });
  if (context.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "stopped while matching; features are kept");
  }
  std::erase_if(pairs, [](const PairRecord& record) { return record.geometry.candidates == 0; });
  TM_RETURN_IF_ERROR(context.checkpoints.save(kCheckpoint, key, encode_pairs(pairs)));
  return pairs;
}

Result<std::vector<PairRecord>> match_walk(const std::vector<ExtractedImage>& images,
                                           const CameraGroups& cameras,
                                           const SequenceMatchingOptions& options,
                                           const StageContext& context) {
  TM_ASSIGN_OR_RETURN(auto matcher,
                      SequenceMatcher::create(options, context.executor, context.checkpoints));
  std::vector<SequenceKeyframe> keyframes;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const CameraId camera = cameras.group_of_image[i];
    keyframes.push_back({&images[i], cameras.groups[index(camera)], camera});
  }
  StageProgress progress(context, Stage::kMatch, images.size());
  for (std::size_t begin = 0; begin < keyframes.size(); begin += kWalkBlock) {
    if (context.stop.stop_requested()) {
      return fail(ErrorCode::kCancelled, "stopped while matching; finished keyframes are kept");
    }
    const std::size_t count = std::min(kWalkBlock, keyframes.size() - begin);
    TM_RETURN_IF_ERROR(matcher.add_block(std::span(keyframes).subspan(begin, count),
                                         [&progress] { progress.advance(); }));
  }
  TM_ASSIGN_OR_RETURN(std::vector<PairRecord> pairs, matcher.all_pairs());
  std::sort(pairs.begin(), pairs.end(), [](const PairRecord& a, const PairRecord& b) {
    return a.pair < b.pair;
  });
  return pairs;
}

}  // namespace trigmesh
