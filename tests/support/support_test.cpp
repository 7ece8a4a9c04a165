#include <algorithm>
#include <cmath>
#include <set>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/matchers.hpp"
#include "tests/support/synthetic_scene.hpp"

namespace trigmesh::test_support {
namespace {

using ::testing::Not;

double rmse_px(const Scene& scene) {
  double sum = 0.0;
  double count = 0.0;
  for (const Landmark& landmark : scene.landmarks) {
    for (const Observation& seen : landmark.track) {
      const View& view = scene.views[index(seen.view)];
      const auto pixel = project(scene.cameras[index(view.camera)],
                                 *view.cam_from_world * landmark.position_in_world);
      sum += (*pixel - view.keypoints_px[index(seen.feature)].cast<double>()).squaredNorm();
      count += 1.0;
    }
  }
  return std::sqrt(sum / count);
}

double epipolar_distance_px(const SyntheticScene& scene,
                            const SyntheticPair& pair,
                            const FeatureMatch& match) {
  const auto& first = scene.truth.views[index(pair.pair.first)].keypoints_px[index(match.first)];
  const auto& second = scene.truth.views[index(pair.pair.second)].keypoints_px[index(match.second)];
  const Eigen::Vector3d line = pair.geometry.fundamental * first.cast<double>().homogeneous();
  return std::abs(second.cast<double>().homogeneous().dot(line)) / line.head<2>().norm();
}

bool same_point(const SyntheticScene& scene, const SyntheticPair& pair, const FeatureMatch& match) {
  const LandmarkId first = scene.truth.views[index(pair.pair.first)].landmarks[index(match.first)];
  return first != kNoLandmark &&
         first == scene.truth.views[index(pair.pair.second)].landmarks[index(match.second)];
}

TEST(SyntheticScene, IsValidForEveryCloudAndPath) {
  for (const CloudKind cloud : {CloudKind::kBox,
                                CloudKind::kSphere,
                                CloudKind::kVolume,
                                CloudKind::kPlane,
                                CloudKind::kTwoPlanes}) {
    for (const PathKind path : {PathKind::kArc,
                                PathKind::kOrbit,
                                PathKind::kLine,
                                PathKind::kForward,
                                PathKind::kPureRotation,
                                PathKind::kRandom}) {
      const auto scene = make_synthetic_scene(
          {.cloud = cloud, .points = 200, .path = path, .views = 6, .clutter_ratio = 0.2});
      EXPECT_TRUE(scene.truth.validate().has_value());
      EXPECT_GT(scene.truth.landmarks.size(), 25U);
      EXPECT_FALSE(scene.pairs.empty());
    }
  }
}

TEST(SyntheticScene, KeypointsAreWhereThePointsProject) {
  EXPECT_LT(rmse_px(make_synthetic_scene({}).truth), 1e-4);  // keypoints are float
  EXPECT_NEAR(rmse_px(make_synthetic_scene({.noise_px = 0.5}).truth), 0.5 * std::sqrt(2.0), 0.02);
}

TEST(SyntheticScene, SameSeedSameSceneOtherSeedOtherScene) {
  const SyntheticSceneOptions options{.noise_px = 1.0, .outlier_ratio = 0.2, .seed = 5};
  const auto a = make_synthetic_scene(options);
  const auto b = make_synthetic_scene(options);
  const auto c = make_synthetic_scene({.noise_px = 1.0, .outlier_ratio = 0.2, .seed = 6});
  EXPECT_EQ(a.truth.views[3].keypoints_px, b.truth.views[3].keypoints_px);
  EXPECT_EQ(a.pairs.back().geometry.inliers, b.pairs.back().geometry.inliers);
  EXPECT_NE(a.truth.views[3].keypoints_px, c.truth.views[3].keypoints_px);
}

TEST(SyntheticScene, RightMatchesObeyTheTrueFundamentalMatrix) {
  const auto scene = make_synthetic_scene({.camera_groups = 2});
  for (const SyntheticPair& pair : scene.pairs) {
    for (const FeatureMatch& match : pair.geometry.inliers) {
      ASSERT_LT(epipolar_distance_px(scene, pair, match), 1e-3);
    }
  }
}

TEST(SyntheticScene, WrongMatchesHaveTheAskedShareAndCanHideNearTheEpipolarLine) {
  const SyntheticSceneOptions options{.dropout_ratio = 0.3,
                                      .clutter_ratio = 0.5,
                                      .outlier_ratio = 0.2,
                                      .outlier_kind = OutlierKind::kNearEpipolarLine};
  const auto scene = make_synthetic_scene(options);
  double wrong = 0.0;
  double near_line = 0.0;
  double all = 0.0;
  for (const SyntheticPair& pair : scene.pairs) {
    std::set<FeatureIndex> used;
    for (const FeatureMatch& match : pair.geometry.inliers) {
      EXPECT_TRUE(used.insert(match.first).second);
      all += 1.0;
      if (!same_point(scene, pair, match)) {
        wrong += 1.0;
        near_line += epipolar_distance_px(scene, pair, match) < 15.0 ? 1.0 : 0.0;
      }
    }
  }
  EXPECT_NEAR(wrong / all, 0.2, 0.01);
  EXPECT_GT(near_line / wrong, 0.6);
}

TEST(SyntheticScene, PairKindFollowsTheGeometry) {
  const auto kinds = [](const SyntheticSceneOptions& options) {
    std::set<TwoViewKind> out;
    for (const SyntheticPair& pair : make_synthetic_scene(options).pairs) {
      out.insert(pair.geometry.kind);
    }
    return out;
  };
  EXPECT_EQ(kinds({.cloud = CloudKind::kVolume}), std::set{TwoViewKind::kGeneral});
  EXPECT_EQ(kinds({.cloud = CloudKind::kPlane}), std::set{TwoViewKind::kPlanar});
  EXPECT_EQ(kinds({.path = PathKind::kPureRotation}), std::set{TwoViewKind::kPureRotation});
}

TEST(SyntheticScene, ComponentsDoNotSeeEachOther) {
  const auto scene = make_synthetic_scene({.points = 150, .views = 4, .components = 2});
  ASSERT_EQ(scene.truth.views.size(), 8U);
  for (const SyntheticPair& pair : scene.pairs) {
    EXPECT_EQ(scene.component_of_view[index(pair.pair.first)],
              scene.component_of_view[index(pair.pair.second)]);
  }
}

TEST(SyntheticScene, WithoutModelKeepsOnlyWhatImagesTell) {
  const Scene bare = without_model(make_synthetic_scene({}).truth);
  EXPECT_EQ(bare.registered_count(), 0U);
  EXPECT_TRUE(bare.landmarks.empty());
  EXPECT_TRUE(bare.validate().has_value());
}

/// The scene as seen in another world frame: x' = s R x + t.
Scene transformed(Scene scene, double s, const Eigen::Quaterniond& r, const Eigen::Vector3d& t) {
  for (View& view : scene.views) {
    const Eigen::Vector3d center = s * (r * camera_center(*view.cam_from_world)) + t;
    const Eigen::Quaterniond rotation = view.cam_from_world->rotation * r.conjugate();
    view.cam_from_world = Rigid3{rotation, -(rotation * center)};
  }
  return scene;
}

TEST(ReconstructionNear, IgnoresTheWorldFrameEvenForCamerasInALine) {
  const Eigen::Quaterniond r(Eigen::AngleAxisd(1.0, Eigen::Vector3d(1.0, 2.0, 3.0).normalized()));
  for (const PathKind path : {PathKind::kArc, PathKind::kLine, PathKind::kForward}) {
    const Scene truth = make_synthetic_scene({.path = path}).truth;
    const Scene moved = transformed(truth, 3.0, r, {5.0, -2.0, 1.0});
    EXPECT_THAT(moved, ReconstructionNear(truth, 1e-9, 1e-9));
    EXPECT_NEAR(compare_reconstruction(moved, truth).scale, 1.0 / 3.0, 1e-9);
  }
}

TEST(ReconstructionNear, SeesErrorsAndMissingViews) {
  const Scene truth = make_synthetic_scene({}).truth;
  EXPECT_THAT(perturbed(truth, {.translation = 0.01}), Not(ReconstructionNear(truth, 0.1, 0.003)));
  EXPECT_THAT(perturbed(truth, {.translation = 0.01}), ReconstructionNear(truth, 0.1, 0.03));
  EXPECT_THAT(perturbed(truth, {.rotation_rad = 0.01}), Not(ReconstructionNear(truth, 0.003, 1.0)));
  Scene missing = truth;
  missing.views[2].cam_from_world.reset();
  EXPECT_THAT(missing, Not(ReconstructionNear(truth, 1.0, 1.0)));
}

TEST(Rigid3Near, MeasuresRotationAndCentre) {
  const Rigid3 pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX())),
                    {1.0, 2.0, 3.0}};
  Rigid3 other = pose;
  other.rotation.coeffs() *= -1.0;
  EXPECT_THAT(other, Rigid3Near(pose, 1e-12, 1e-12));
  other.translation.x() += 0.1;
  EXPECT_THAT(other, Not(Rigid3Near(pose, 1.0, 0.09)));
  EXPECT_THAT(other, Rigid3Near(pose, 1e-12, 0.11));
}

}  // namespace
}  // namespace trigmesh::test_support
