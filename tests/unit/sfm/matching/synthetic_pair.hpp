#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "sfm/geometry/rigid3.hpp"
#include "sfm/matching/two_view_verification.hpp"
#include "tests/support/random.hpp"

namespace trigmesh::test_support {

/// Two images of a point cloud, 1536 x 1024, focal length 1200, keypoint i of both sees the same
/// thing.
struct SyntheticPair {
  static constexpr int kWidth = 1536;
  static constexpr int kHeight = 1024;

  Eigen::Matrix3d calibration;
  Eigen::Matrix3d fundamental;  ///< zero when the camera did not move
  std::vector<Eigen::Vector2d> first;
  std::vector<Eigen::Vector2d> second;
  std::vector<FeatureMatch> matches;  ///< i with i
  std::size_t true_count = 0;         ///< the first so many keypoints are true, the rest random

  [[nodiscard]] VerificationImage image(const std::vector<Eigen::Vector2d>& points) const {
    return {
        .points_px = points, .width_px = kWidth, .height_px = kHeight, .calibration = calibration};
  }

  [[nodiscard]] TwoViewGeometry verify(const VerificationOptions& options = {}) const {
    return verify_pair(matches, image(first), image(second), options);
  }

  [[nodiscard]] TwoViewGeometry verify_uncalibrated(const VerificationOptions& options = {}) const {
    VerificationImage a = image(first);
    VerificationImage b = image(second);
    a.calibration.reset();
    b.calibration.reset();
    return verify_pair(matches, a, b, options);
  }
};

struct SyntheticPairOptions {
  std::size_t true_count = 300;
  std::size_t outlier_count = 0;
  double noise_px = 0.5;
  double depth = 6.0;            ///< of the middle of the cloud
  double depth_variation = 2.0;  ///< 0 makes it a plane
  Rigid3 second_from_first{Eigen::Quaterniond(Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY())),
                           Eigen::Vector3d(-1.0, 0.1, 0.1)};
  unsigned seed = 1;
};

inline SyntheticPair make_pair(const SyntheticPairOptions& options) {
  Random random(options.seed);
  SyntheticPair out;
  out.calibration << 1200.0, 0.0, 767.5, 0.0, 1200.0, 511.5, 0.0, 0.0, 1.0;
  const Rigid3& motion = options.second_from_first;
  const Eigen::Vector3d& t = motion.translation;
  Eigen::Matrix3d cross;
  cross << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  const Eigen::Matrix3d k_inverse = out.calibration.inverse();
  out.fundamental = k_inverse.transpose() * cross * motion.rotation.toRotationMatrix() * k_inverse;
  const auto noise = [&] {
    const double x = options.noise_px * random.normal();
    return Eigen::Vector2d(x, options.noise_px * random.normal());
  };
  const auto anywhere = [&] {
    const double x = random.uniform(0.0, SyntheticPair::kWidth - 1.0);
    return Eigen::Vector2d(x, random.uniform(0.0, SyntheticPair::kHeight - 1.0));
  };
  while (out.first.size() < options.true_count) {
    const Eigen::Vector2d pixel = anywhere();
    const double depth = options.depth + options.depth_variation * random.uniform(-1.0, 1.0);
    const Eigen::Vector3d point = depth * (k_inverse * pixel.homogeneous());
    const Eigen::Vector2d seen = (out.calibration * (motion * point)).hnormalized();
    if (seen.x() < 0.0 || seen.y() < 0.0 || seen.x() > SyntheticPair::kWidth - 1 ||
        seen.y() > SyntheticPair::kHeight - 1) {
      continue;
    }
    out.first.push_back(pixel + noise());
    out.second.push_back(seen + noise());
  }
  out.true_count = options.true_count;
  for (std::size_t i = 0; i < options.outlier_count; ++i) {
    out.first.push_back(anywhere());
    out.second.push_back(anywhere());
  }
  for (std::size_t i = 0; i < out.first.size(); ++i) {
    out.matches.push_back({id_of<FeatureIndex>(i), id_of<FeatureIndex>(i)});
  }
  return out;
}

}  // namespace trigmesh::test_support
