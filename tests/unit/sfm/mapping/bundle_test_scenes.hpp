#pragma once

#include <cstring>

#include "sfm/mapping/bundle_adjustment.hpp"
#include "tests/support/synthetic_scene.hpp"

// What the tests of bundle adjustment share.

namespace trigmesh::bundle_test {

/// The same bits, not only equal values.
inline bool same_bits(const Rigid3& a, const Rigid3& b) {
  return std::memcmp(a.rotation.coeffs().data(), b.rotation.coeffs().data(), 4 * sizeof(double)) ==
             0 &&
         std::memcmp(a.translation.data(), b.translation.data(), 3 * sizeof(double)) == 0;
}

/// A true scene without occlusion.
inline Scene make_truth(test_support::SyntheticSceneOptions options = {}) {
  options.cloud = test_support::CloudKind::kVolume;
  return test_support::make_synthetic_scene(options).truth;
}

/// No robust loss, no early stop.
inline BundleOptions least_squares() {
  BundleOptions options;
  options.loss = RobustLoss::kNone;
  options.function_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  return options;
}

/// The default camera of synthetic scenes with a lens of some distortion.
inline Camera lens(CameraModel model) {
  Camera camera = test_support::SyntheticSceneOptions{}.camera;
  camera.model = model;
  switch (model) {
    case CameraModel::kPinhole:
      break;
    case CameraModel::kRadial:
      camera.distortion = {-0.12, 0.03, 0.0, 0.0};
      break;
    case CameraModel::kBrownConrady:
      camera.distortion = {-0.12, 0.03, 0.002, -0.001};
      break;
    case CameraModel::kKannalaBrandt:
      camera.distortion = {0.03, -0.01, 0.004, -0.001};
      break;
  }
  return camera;
}

}  // namespace trigmesh::bundle_test
