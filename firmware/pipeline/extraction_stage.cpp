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

/// Extracts one photograph or takes it from its checkpoint.
class PhotoWorker {
 public:
  PhotoWorker(const PhotoSet& photos,
              const FeatureExtractor& extractor,
              std::uint64_t settings,
              const StageContext& context)
      : photos_(photos), extractor_(extractor), settings_(settings), context_(context) {}

  /// The entry, or the error that ends the stage: the work folder cannot be written.
  [[nodiscard]] Result<ExtractedImage> operator()(std::size_t i) const {
    const auto file = photos_.read(i);
    if (!file) {
      return ExtractedImage{std::nullopt, file.error()};
    }
    const auto mask = read_mask(photos_, i);
    if (!mask) {
      return ExtractedImage{std::nullopt, mask.error()};
    }
    const std::uint64_t of_file = content_hash(*file, settings_);
    const std::uint64_t key = *mask ? content_hash(**mask, of_file) : of_file;
    const std::string checkpoint = fmt::format("features-{:06}", i);
    if (auto stored = from_checkpoint(checkpoint, key)) {
      return ExtractedImage{std::move(stored), {}};
    }
    auto extracted = extract_image_features(*file, extractor_);
    if (!extracted) {
      return ExtractedImage{std::nullopt, extracted.error()};
    }
    if (*mask) {
      const auto usable =
          decode_mask(**mask, photos_.names[i], extracted->width_px, extracted->height_px);
      if (!usable) {
        return ExtractedImage{std::nullopt, usable.error()};
      }
      drop_masked_features(*usable, *extracted);
    }
    TM_RETURN_IF_ERROR(
        context_.checkpoints.save(checkpoint, key, encode_image_features(*extracted)));
    return ExtractedImage{std::move(*extracted), {}};
  }

 private:
  [[nodiscard]] std::optional<ImageFeatures> from_checkpoint(const std::string& name,
                                                             std::uint64_t key) const {
    const auto payload = context_.checkpoints.load(name, key);
    if (!payload) {
      return std::nullopt;
    }
    auto decoded = decode_image_features(*payload);
    return decoded ? std::optional(std::move(*decoded)) : std::nullopt;
  }

  const PhotoSet& photos_;
  const FeatureExtractor& extractor_;
  std::uint64_t settings_;
  const StageContext& context_;
};

}  // namespace

Result<std::vector<ExtractedImage>> extract_photos(const PhotoSet& photos,
                                                   FeatureKind kind,
                                                   const FeatureOptions& options,
                                                   const StageContext& context) {
  TM_ASSIGN_OR_RETURN(const auto extractor, create_feature_extractor(kind, options));
  const PhotoWorker worker(photos, *extractor, content_hash(settings_text(kind, options)), context);
  std::vector<ExtractedImage> images(photos.names.size());
  std::vector<std::optional<Error>> failures(photos.names.size());
  std::atomic<bool> failed = false;
  StageProgress progress(context, Stage::kExtract, photos.names.size());
  context.executor.for_each_index(photos.names.size(), [&](std::size_t i) {
    if (context.stop.stop_requested() || failed) {
      return;
    }
    auto image = worker(i);
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
  return images;
}

}  // namespace trigmesh
