#include "sfm/exchange/projections.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/exchange/example_scene.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

TEST(Projections, ProjectPointsLikeTheUndistortedCameras) {
  Scene scene = test_support::example_scene(CameraModel::kBrownConrady);
  const auto read = read_projections(*write_projections(scene));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  ASSERT_EQ(read->size(), scene.views.size());
  for (std::size_t i = 0; i < read->size(); ++i) {
    const View& view = scene.views[i];
    Camera undistorted = scene.cameras[index(view.camera)];
    undistorted.model = CameraModel::kPinhole;
    undistorted.distortion = {};
    EXPECT_EQ((*read)[i].name, view.name);
    for (const Landmark& landmark : scene.landmarks) {
      const auto expected = project(undistorted, *view.cam_from_world * landmark.position_in_world);
      ASSERT_TRUE(expected.has_value());
      const Eigen::Vector3d pixel =
          (*read)[i].projection * landmark.position_in_world.homogeneous();
      EXPECT_LT((pixel.hnormalized() - *expected).norm(), 1e-9);
    }
  }
}

TEST(Projections, LeaveOutViewsWithoutPose) {
  Scene scene = test_support::example_scene(CameraModel::kPinhole, 3, 20);
  scene.views[1].cam_from_world.reset();
  const auto read = read_projections(*write_projections(scene));
  ASSERT_TRUE(read.has_value());
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[1].name, scene.views[2].name);
}

TEST(Projections, KeepBlanksInNames) {
  Scene scene = test_support::example_scene(CameraModel::kPinhole, 2, 20);
  scene.views[0].name = "12 34 some image.jpg";
  const auto read = read_projections(*write_projections(scene));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ((*read)[0].name, scene.views[0].name);
}

TEST(Projections, RefuseLinesThatAreNoProjection) {
  for (const char* line : {"name 1 2 3 4 5 6 7 8 9 10 11",
                           "1 2 3 4 5 6 7 8 9 10 11 12",
                           "name 1 2 3 4 5 6 7 8 9 10 11 x",
                           "name 1 2 3 4 5 6 7 8 9 10 11 inf",
                           " 1 2 3 4 5 6 7 8 9 10 11 12"}) {
    const auto read = read_projections(std::string("\n") + line + "\n");
    ASSERT_FALSE(read.has_value()) << line;
    EXPECT_EQ(read.error().code, ErrorCode::kCorruptData);
    EXPECT_THAT(read.error().message, HasSubstr("line 2"));
  }
}

}  // namespace
}  // namespace trigmesh
