#pragma once

#include <memory>

#include "firmware/base/result.hpp"
#include "sfm/features/features.hpp"

/// The makers behind create_feature_extractor, one a kind. Private to this folder: callers use the
/// factory, which has validated the options before it calls any of them.
namespace trigmesh {

using FeatureExtractorResult = Result<std::unique_ptr<FeatureExtractor>>;

[[nodiscard]] FeatureExtractorResult create_sift_extractor(const FeatureOptions& options);
[[nodiscard]] FeatureExtractorResult create_surf_extractor(const FeatureOptions& options);
[[nodiscard]] FeatureExtractorResult create_akaze_extractor(const FeatureOptions& options);
[[nodiscard]] FeatureExtractorResult create_orb_extractor(const FeatureOptions& options);

/// The precondition of FeatureExtractor::extract: kInvalidArgument unless `grey` is CV_8UC1 and at
/// least 16x16.
[[nodiscard]] Result<> check_grey_image(const cv::Mat& grey);

/// The order that FeatureExtractor::extract promises: coarsest first; ties by response, then y,
/// then x (and by angle between two orientations of one point, so that the order is total).
[[nodiscard]] bool comes_before(const Keypoint& a, const Keypoint& b);

/// Brings keypoints into the order that FeatureExtractor::extract promises (coarsest first; ties by
/// response, then y, then x) and moves their descriptor rows with them.
void sort_features(FeatureSet& features);

}  // namespace trigmesh
