#include "firmware/pipeline/extraction_stage.hpp"

#include <mutex>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/photo_set.hpp"

namespace trigmesh {

namespace {

std::string settings_text(FeatureKind kind, const FeatureOptions& options) {
  return fmt::format(
      "{} {} {} {}", to_string(kind), options.max_keypoints, options.oriented, options.upsample);
}

}  // namespace

Result<PhotoExtractor> PhotoExtractor::create(FeatureKind kind,
                                              const FeatureOptions& options,
                                              const CheckpointFolder& checkpoints) {
  TM_ASSIGN_OR_RETURN(auto extractor, create_feature_extractor(kind, options));
  return PhotoExtractor(
      std::move(extractor), content_hash(settings_text(kind, options)), checkpoints);
}

Result<ExtractedImage> PhotoExtractor::operator()(const PhotoSet& photos, std::size_t photo) const {
  const auto file = photos.read(photo);
  if (!file) {
    return ExtractedImage{std::nullopt, file.error()};
  }
  const auto mask = read_mask(photos, photo);
  if (!mask) {
    return ExtractedImage{std::nullopt, mask.error()};
  }
  const std::uint64_t of_file = content_hash(*file, settings_);
  const std::uint64_t key = *mask ? content_hash(**mask, of_file) : of_file;
  const std::string checkpoint = fmt::format("features-{:06}", photo);
  if (auto stored = from_checkpoint(checkpoint, key)) {
    return ExtractedImage{std::move(stored), {}};
  }
  auto extracted = extract_image_features(*file, *extractor_);
  if (!extracted) {
    return ExtractedImage{std::nullopt, extracted.error()};
  }
  if (*mask) {
    const auto usable =
        decode_mask(**mask, photos.names[photo], extracted->width_px, extracted->height_px);
    if (!usable) {
      return ExtractedImage{std::nullopt, usable.error()};
    }
    drop_masked_features(*usable, *extracted);
  }
  TM_RETURN_IF_ERROR(checkpoints_->save(checkpoint, key, encode_image_features(*extracted)));
  return ExtractedImage{std::move(*extracted), {}};
}

std::optional<ImageFeatures> PhotoExtractor::from_checkpoint(const std::string& name,
                                                             std::uint64_t key) const {
  const auto payload = checkpoints_->load(name, key);
  if (!payload) {
    return std::nullopt;
  }
  auto decoded = decode_image_features(*payload);
  return decoded ? std::optional(std::move(*decoded)) : std::nullopt;
}

void DuplicateFilter::refuse_duplicate(const std::string& name, ExtractedImage& image) {
  if (!image.features) {
    return;
  }
  const auto [place, is_new] = first_with_.try_emplace(image.features->content, name);
  if (!is_new) {
    image = {std::nullopt,
             {ErrorCode::kInsufficientData, fmt::format("the same file as {}", place->second)}};
  }
}

Result<std::vector<ExtractedImage>> extract_photos(const PhotoSet& photos,
                                                   FeatureKind kind,
                                                   const FeatureOptions& options,
                                                   const StageContext& context) {
  TM_ASSIGN_OR_RETURN(const auto extractor,
                      PhotoExtractor::create(kind, options, context.checkpoints));
  std::vector<ExtractedImage> images(photos.names.size());
  std::vector<std::optional<Error>> failures(photos.names.size());
  std::atomic<bool> failed = false;
  StageProgress progress(context, Stage::kExtract, photos.names.size());
  context.executor.for_each_index(photos.names.size(), [&](std::size_t i) {
    if (context.stop.stop_requested() || failed) {
      return;
    }
    auto image = extractor(photos, i);
    if (image) {
      images[i] = std::move(*image);
    } else {
      failures[i] = image.error();
      failed = true;
    }
    progress.advance();
  });
  for (const std::optional<Error>& failure : failures) {
    if (failure) {
      return tl::unexpected(*failure);
    }
  }
  if (context.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled,
                "stopped while finding features; finished photographs are kept");
  }
  DuplicateFilter duplicates;
  for (std::size_t i = 0; i < images.size(); ++i) {
    duplicates.refuse_duplicate(photos.names[i], images[i]);
  }
  return images;
}

}  // namespace trigmesh
