#include "sfm/features/extractors.hpp"

namespace trigmesh {

FeatureExtractorResult create_surf_extractor(const FeatureOptions& /*options*/) {
  return fail(ErrorCode::kUnsupported, "SURF features are not in this build");
}

}  // namespace trigmesh
