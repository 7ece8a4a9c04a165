#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/image_features.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "sfm/features/features.hpp"

namespace trigmesh {

struct PhotoSet;

/// One photograph after extraction: its features, or why there are none.
struct ExtractedImage {
  std::optional<ImageFeatures> features;
  Error error;  ///< meaningful only without features
};

/// Finds the keypoints of single photographs, or takes them from their checkpoints. Thread-safe.
class PhotoExtractor {
 public:
  /// `checkpoints` outlive it. kInvalidArgument: options.
  [[nodiscard]] static Result<PhotoExtractor> create(FeatureKind kind,
                                                     const FeatureOptions& options,
                                                     const CheckpointFolder& checkpoints);

  /// The entry of one photograph, with an error in it when it cannot be read. Fails only when the
  /// work folder cannot be written: kIo, kNoSpace.
  [[nodiscard]] Result<ExtractedImage> operator()(const PhotoSet& photos, std::size_t photo) const;

 private:
  PhotoExtractor(std::unique_ptr<FeatureExtractor> extractor,
                 std::uint64_t settings,
                 const CheckpointFolder& checkpoints)
      : extractor_(std::move(extractor)), settings_(settings), checkpoints_(&checkpoints) {}

  [[nodiscard]] std::optional<ImageFeatures> from_checkpoint(const std::string& name,
                                                             std::uint64_t key) const;

  std::unique_ptr<FeatureExtractor> extractor_;
  std::uint64_t settings_;
  const CheckpointFolder* checkpoints_;
};

/// Refuses photographs whose file equals an earlier one: they add nothing and would only look like
/// perfect overlap.
class DuplicateFilter {
 public:
  /// Images come in the order of their photographs.
  void refuse_duplicate(const std::string& name, ExtractedImage& image);

 private:
  std::map<std::uint64_t, std::string> first_with_;  ///< name of the first photograph, by content
};

/// Reads every photograph and finds its keypoints. A photograph that cannot be read is an entry
/// with an error, not the end, and so is one whose file equals an earlier one. Each finished
/// photograph is a checkpoint. Errors: kCancelled, and kIo or kNoSpace of the checkpoint folder.
[[nodiscard]] Result<std::vector<ExtractedImage>> extract_photos(const PhotoSet& photos,
                                                                 FeatureKind kind,
                                                                 const FeatureOptions& options,
                                                                 const StageContext& context);

}  // namespace trigmesh
