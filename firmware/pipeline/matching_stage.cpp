#include "firmware/pipeline/matching_stage.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/binary_stream.hpp"
#include "sfm/matching/descriptor_matcher.hpp"
#include "sfm/matching/two_view_verification.hpp"

namespace trigmesh {

namespace {

constexpr const char* kCheckpoint = "pairs";

/// What comparing needs of one image.
struct ComparableImage {
  std::optional<DescriptorIndex> index;  ///< absent for an unreadable image
  std::vector<Eigen::Vector2d> undistorted_px;
  VerificationImage view;
};

/// Pixels as a lens without distortion would give them; a keypoint without a ray becomes not-a-number, which no match survives.
std::vector<Eigen::Vector2d> undistort(const Camera& camera, const std::vector<Keypoint>& keypoints) {
  Camera ideal = camera;
  ideal.model = CameraModel::kPinhole;
  std::vector<Eigen::Vector2d> result;
  result.reserve(keypoints.size());
  for (const Keypoint& keypoint : keypoints) {
    const Eigen::Vector2d pixel(static_cast<double>(keypoint.x_px), static_cast<double>(keypoint.y_px));
    const auto ray = normalize_pixel(camera, pixel);
    const auto straight = ray ? project(ideal, ray->homogeneous()) : std::nullopt;
    result.push_back(straight.value_or(Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN())));
  }
  return result;
}

Result<ComparableImage> prepare(const ImageFeatures& image, const CameraGroup& group) {
  ComparableImage result;
  TM_ASSIGN_OR_RETURN(result.index, DescriptorIndex::build(image.features));
  result.undistorted_px = undistort(group.camera, image.features.keypoints);
  result.view = {result.undistorted_px, image.width_px, image.height_px, std::nullopt};
  if (group.knowledge != IntrinsicsKnowledge::kUnknown) {
    result.view.calibration = group.camera.calibration_matrix();
  }
  return result;
}

std::uint64_t key_of(const std::vector<ExtractedImage>& images,
                     const CameraGroups& cameras,
                     const MatchingStageOptions& options) {
  std::string text = fmt::format("{} {} {}", static_cast<int>(options.pair_mode), options.ordered, options.seed);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const CameraGroup& group = cameras.groups[index(cameras.group_of_image[i])];
    const FeatureSet* features = images[i].features ? &images[i].features->features : nullptr;
    text += fmt::format("\n{} {} {}", images[i].features ? images[i].features->content : 0,
                        features != nullptr ? content_hash(features->descriptors) : 0, static_cast<int>(group.knowledge));
    for (const double value : group.camera.intrinsics()) {
      text += fmt::format(" {}", value);
    }
  }
  return content_hash(text);
}

TwoViewGeometry compare(const ComparableImage& first, const ComparableImage& second, const MatchingStageOptions& options) {
  MatchOptions matching;
  VerificationOptions verification;
  verification.seed = static_cast<int>(options.seed & 0x7fffffffU);
  return verify_pair(match_descriptors(*first.index, *second.index, matching), first.view, second.view, verification);
}

Result<std::vector<ImagePair>> choose_pairs(const std::vector<ExtractedImage>& images, const std::vector<ComparableImage>&, const MatchingStageOptions&, const StageContext&) {
  std::vector<ImagePair> r;
  for (std::size_t i = 0; i < images.size(); ++i) for (std::size_t j = i + 1; j < images.size(); ++j) if (images[i].features && images[j].features) r.push_back({id_of<ViewId>(i), id_of<ViewId>(j)});
  return r;
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
    if (kind > static_cast<std::uint32_t>(TwoViewKind::kDuplicate)) {
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
  std::vector<ComparableImage> comparable(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (images[i].features) {
      const CameraGroup& group = cameras.groups[index(cameras.group_of_image[i])];
      TM_ASSIGN_OR_RETURN(comparable[i], prepare(*images[i].features, group));
      comparable[i].view.points_px = comparable[i].undistorted_px;
    }
  }
  TM_ASSIGN_OR_RETURN(const std::vector<ImagePair> chosen, choose_pairs(images, comparable, options, context));
  std::vector<PairRecord> pairs(chosen.size());
  StageProgress progress(context, Stage::kMatch, chosen.size());
  context.executor.for_each_index(chosen.size(), [&](std::size_t i) {
    if (context.stop.stop_requested()) {
      return;
    }
    pairs[i] = {chosen[i], compare(comparable[index(chosen[i].first)], comparable[index(chosen[i].second)], options)};
    progress.advance();
  });
  if (context.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "stopped while matching; features are kept");
  }
  std::erase_if(pairs, [](const PairRecord& record) { return record.geometry.candidates == 0; });
  TM_RETURN_IF_ERROR(context.checkpoints.save(kCheckpoint, key, encode_pairs(pairs)));
  return pairs;
}

}  // namespace trigmesh
