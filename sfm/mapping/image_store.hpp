#pragma once

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sfm/mapping/mapper.hpp"
#include "sfm/mapping/track_table.hpp"
#include "sfm/matching/matches.hpp"
#include "sfm/scene/outcome.hpp"

namespace trigmesh {

/// A verified pair with its matches, as it was added.
struct PairRecord {
  ImagePair pair;
  TwoViewGeometry geometry;
};

/// Positions of the pairs, those with most inliers first: strong pairs make better tracks.
[[nodiscard]] inline std::vector<std::size_t> strongest_first(std::span<const PairRecord> pairs) {
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return pairs[a].geometry.inliers.size() > pairs[b].geometry.inliers.size();
  });
  return order;
}

/// How the last try to find the pose of an image ended.
struct PoseAttempt {
  std::size_t map_matches = 0;
  std::size_t inliers = 0;
  RefusalReason reason = RefusalReason::kNone;  ///< kNone: not tried yet, or registered
  /// Median angle under which the landmarks of its model were seen, when that was too small.
  std::optional<double> model_parallax_deg{};
};

/// One image as the mapper knows it.
struct ImageRecord {
  std::string name;
  CameraId camera{};
  std::vector<Eigen::Vector2f> keypoints_px;
  std::vector<std::size_t> pairs;  ///< positions in ImageStore::pairs
  PoseAttempt attempt;
  bool registered = false;  ///< in any map
};

/// A camera group before adjustment.
struct CameraRecord {
  Camera camera;
  IntrinsicsKnowledge knowledge = IntrinsicsKnowledge::kGiven;
};

/// Everything that was given to the mapper, and what matches make of it. Shared by all maps.
struct ImageStore {
  std::vector<CameraRecord> cameras;
  std::vector<ImageRecord> images;
  std::vector<PairRecord> pairs;
  TrackTable tracks;
  std::vector<std::vector<float>>
      sigmas_px;  ///< per view and keypoint: standard deviation of its position
};

}  // namespace trigmesh
