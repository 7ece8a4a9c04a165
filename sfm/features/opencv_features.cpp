#include "sfm/features/extractors.hpp"

namespace trigmesh {

FeatureExtractorResult create_akaze_extractor(const FeatureOptions& /*options*/) {
  return fail(ErrorCode::kUnsupported, "AKAZE features are not in this build");
}

FeatureExtractorResult create_orb_extractor(const FeatureOptions& /*options*/) {
  return fail(ErrorCode::kUnsupported, "ORB features are not in this build");
}

}  // namespace trigmesh
