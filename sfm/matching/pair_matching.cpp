#include "sfm/matching/pair_matching.hpp"

namespace trigmesh {

namespace {

VerificationImage verification_image(const MatchableImage& image) {
  return {image.points_px, image.width_px, image.height_px, image.calibration};
}

TwoViewGeometry match_unguided(const MatchableImage& first,
                               const MatchableImage& second,
                               const MatchOptions& matching,
                               const VerificationOptions& verification) {
  return verify_pair(match_descriptors(first.index, second.index, matching),
                     verification_image(first),
                     verification_image(second),
                     verification);
}

bool has_epipolar_lines(TwoViewKind kind) {
  return kind == TwoViewKind::kGeneral || kind == TwoViewKind::kPlanar;
}

}  // namespace

TwoViewGeometry match_pair(const MatchableImage& first,
                           const MatchableImage& second,
                           const PairMatchingOptions& options) {
  MatchOptions coarse = options.matching;
  coarse.max_features = options.coarse_features;
  TwoViewGeometry geometry = match_unguided(first, second, coarse, options.verification);
  if (geometry.kind == TwoViewKind::kNone && geometry.candidates >= options.min_matches_for_all) {
    geometry = match_unguided(first, second, options.matching, options.verification);
  }
  if (!has_epipolar_lines(geometry.kind)) {
    return geometry;
  }
  const std::vector<FeatureMatch> matches = match_guided({first.index, first.points_px},
                                                         {second.index, second.points_px},
                                                         geometry.fundamental,
                                                         options.guided);
  return verify_pair(
      matches, verification_image(first), verification_image(second), options.verification);
}

}  // namespace trigmesh
