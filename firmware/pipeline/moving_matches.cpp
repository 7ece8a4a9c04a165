#include "firmware/pipeline/moving_matches.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/moving/contradicting_features.hpp"
#include "sfm/moving/moving_keypoints.hpp"

namespace trigmesh {

namespace {

// Enough for some dozen on anything that matters, and quick: mapping must stay a matter of seconds.
constexpr int kComparedKeypoints = 2500;
constexpr std::size_t kPartners = 24;
// Distances that are pixels of a picture this wide grow with the picture.
constexpr double kUsualSidePx = 480.0;

// Fewer matches than this part of all are no reason to map again.
constexpr double kMinDroppedRatio = 0.002;

/// A registered image as sfm/moving compares it.
ComparableView comparable_view(const View& view,
                               const Camera& camera,
                               const ExtractedImage& image) {
  ComparableView comparable;
  const FeatureSet& all = image.features->features;
  const std::size_t count = std::min(all.size(), std::size_t{kComparedKeypoints});
  comparable.features = {
      .kind = all.kind,
      .keypoints = {all.keypoints.begin(),
                    all.keypoints.begin() + static_cast<std::ptrdiff_t>(count)},
      .descriptor_bytes = all.descriptor_bytes,
      .descriptors = {
          all.descriptors.begin(),
          all.descriptors.begin() + static_cast<std::ptrdiff_t>(count * all.descriptor_bytes)}};
  comparable.open.assign(count, 1);
  comparable.camera = camera;
  comparable.camera.model = CameraModel::kPinhole;
  comparable.camera.distortion = {};
  comparable.cam_from_world = *view.cam_from_world;
  for (const Keypoint& keypoint : comparable.features.keypoints) {
    const auto ray = normalize_pixel(camera, Eigen::Vector2d(keypoint.x_px, keypoint.y_px));
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    comparable.points_px.push_back(ray ? Eigen::Vector2d(camera.fx_px * ray->x() + camera.cx_px,
                                                         camera.fy_px * ray->y() + camera.cy_px)
                                       : Eigen::Vector2d(kNone, kNone));
  }
  return comparable;
}

/// The registered images and where each stands among them.
struct Comparison {
  std::vector<std::size_t> images;   ///< position of each compared view among the images
  std::vector<std::size_t> view_of;  ///< the way back; the number of images where there is none
  std::vector<ComparableView> views;
  double side_px = 1.0;  ///< longest of all pictures
};

Comparison registered_images(const Scene& scene, const std::vector<ExtractedImage>& images) {
  Comparison comparison;
  comparison.view_of.assign(images.size(), images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const View& view = scene.views[i];
    if (!view.cam_from_world || !images[i].features) {
      continue;
    }
    const Camera& camera = scene.cameras[index(view.camera)];
    comparison.side_px = std::max({comparison.side_px,
                                   static_cast<double>(camera.width_px),
                                   static_cast<double>(camera.height_px)});
    comparison.view_of[i] = comparison.images.size();
    comparison.images.push_back(i);
    comparison.views.push_back(comparable_view(view, camera, images[i]));
  }
  return comparison;
}

/// Who matches whom best comes first.
void add_neighbors(const std::vector<PairRecord>& pairs, Comparison& comparison) {
  const std::size_t nobody = comparison.view_of.size();
  for (const std::size_t p : strongest_first(pairs)) {
    const std::size_t a = comparison.view_of[index(pairs[p].pair.first)];
    const std::size_t b = comparison.view_of[index(pairs[p].pair.second)];
    // Half of the partners are left for views that are not near.
    if (a != nobody && b != nobody && comparison.views[a].neighbors.size() < kPartners / 2 &&
        comparison.views[b].neighbors.size() < kPartners / 2) {
      comparison.views[a].neighbors.push_back(b);
      comparison.views[b].neighbors.push_back(a);
    }
  }
}

ContradictionOptions contradiction_options(double side_px) {
  ContradictionOptions options;
  options.max_keypoints = kComparedKeypoints;
  options.max_partners = kPartners;
  const double scale = std::max(1.0, side_px / kUsualSidePx);
  options.max_agreement_px *= scale;
  options.min_contradiction_px *= scale;
  return options;
}

/// The pair without matches that have an end on something that moved.
PairRecord without_moving(const PairRecord& pair,
                          std::span<const std::vector<std::uint8_t>> moving) {
  PairRecord kept = pair;
  const auto has = [&](ViewId view, FeatureIndex feature) {
    const std::vector<std::uint8_t>& of_image = moving[index(view)];
    return !of_image.empty() && of_image[index(feature)] != 0;
  };
  std::erase_if(kept.geometry.inliers, [&](const FeatureMatch& match) {
    return has(pair.pair.first, match.first) || has(pair.pair.second, match.second);
  });
  return kept;
}

std::size_t match_count(const std::vector<PairRecord>& pairs) {
  return std::accumulate(
      pairs.begin(), pairs.end(), std::size_t{0}, [](std::size_t sum, const PairRecord& pair) {
        return sum + pair.geometry.inliers.size();
      });
}

}  // namespace

Result<std::optional<std::vector<PairRecord>>> drop_moving_matches(
    const Scene& scene,
    const std::vector<ExtractedImage>& images,
    const std::vector<PairRecord>& pairs,
    const StageContext& context) {
  Comparison comparison = registered_images(scene, images);
  add_neighbors(pairs, comparison);
  const double scale = std::max(1.0, comparison.side_px / kUsualSidePx);
  TM_ASSIGN_OR_RETURN(const auto evidence,
                      compare_views(std::move(comparison.views),
                                    contradiction_options(comparison.side_px),
                                    context.executor));
  SurroundingsOptions surroundings;
  surroundings.max_distance_px *= scale;
  std::vector<std::vector<std::uint8_t>> moving(images.size());
  context.executor.for_each_index(evidence.size(), [&](std::size_t k) {
    const std::size_t i = comparison.images[k];
    moving[i] = moving_keypoints(images[i].features->features.keypoints, evidence[k], surroundings);
  });
  std::vector<PairRecord> kept;
  for (const PairRecord& pair : pairs) {
    kept.push_back(without_moving(pair, moving));
  }
  const auto all = static_cast<double>(match_count(pairs));
  if (all - static_cast<double>(match_count(kept)) < kMinDroppedRatio * all) {
    return std::optional<std::vector<PairRecord>>();
  }
  return std::optional(std::move(kept));
}

}  // namespace trigmesh
