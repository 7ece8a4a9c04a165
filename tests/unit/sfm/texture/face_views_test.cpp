#include "sfm/texture/face_views.hpp"

#include <gtest/gtest.h>

#include "tests/unit/sfm/texture/painted_scene.hpp"

namespace trigmesh {
namespace {

TEST(FindFaceViews, HiddenFacesAreNotSeen) {
  TriangleMesh mesh = square_mesh(0.5, 10, 0.0);
  const std::size_t ground_faces = mesh.faces.size();
  append(mesh, square_mesh(0.15, 2, 0.6));
  PaintedScene scene;
  scene.add_view({0.0, 0.0, 2.0}, ground_color);
  scene.add_view({1.5, 0.0, 1.5}, ground_color);
  SerialExecutor executor;
  const auto faces = find_face_views(mesh, scene.views, scene.images, {}, executor);
  ASSERT_TRUE(faces.has_value());
  // The middle of the ground lies under the lid for the first view, in the open for the second.
  const std::size_t middle = ground_faces / 2 + 10;
  ASSERT_EQ(faces->of(middle).size(), 1U);
  EXPECT_EQ(faces->of(middle)[0].view, 1U);
  EXPECT_EQ(faces->of(0).size(), 2U);
}

TEST(FindFaceViews, MaskedAndBackFacesAreNotSeen) {
  const TriangleMesh mesh = square_mesh(0.5, 4, 0.0);
  PaintedScene scene;
  scene.add_view({0.0, 0.1, 2.0}, ground_color);
  scene.add_view({0.0, 0.1, -2.0}, ground_color);
  scene.add_view({0.0, 0.1, 2.0}, ground_color);
  scene.images.pictures[2].mask = cv::Mat(90, 120, CV_8UC1, cv::Scalar(0));
  SerialExecutor executor;
  const auto faces = find_face_views(mesh, scene.views, scene.images, {}, executor);
  ASSERT_TRUE(faces.has_value());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    ASSERT_EQ(faces->of(f).size(), 1U);
    EXPECT_EQ(faces->of(f)[0].view, 0U);
  }
}

TEST(FindFaceViews, NearerAndSteeperViewsAreBetter) {
  const TriangleMesh mesh = square_mesh(0.3, 2, 0.0);
  PaintedScene scene;
  scene.add_view({0.0, 0.1, 1.5}, ground_color);
  scene.add_view({0.0, 0.1, 3.0}, ground_color);
  scene.add_view({1.2, 0.1, 0.9}, ground_color);
  SerialExecutor executor;
  const auto faces = find_face_views(mesh, scene.views, scene.images, {}, executor);
  ASSERT_TRUE(faces.has_value());
  ASSERT_EQ(faces->of(0).size(), 3U);
  EXPECT_GT(faces->of(0)[0].quality, faces->of(0)[1].quality);
  EXPECT_GT(faces->of(0)[0].quality, faces->of(0)[2].quality);
}

TEST(FindFaceViews, LooksWithAFewHiddenPixelsAreMakeshift) {
  const TriangleMesh ground = square_mesh(0.5, 20, 0.0);  // faces of some five pixels
  TriangleMesh covered = ground;
  append(covered, square_mesh(0.1512, 1, 0.3));
  PaintedScene scene;
  scene.add_view({0.0, 0.1, 2.0}, ground_color);
  SerialExecutor executor;
  const VisibilityOptions no_margin{.min_view_cosine = 0.2, .silhouette_margin_px = 0};
  const auto open = find_face_views(ground, scene.views, scene.images, no_margin, executor);
  const auto faces = find_face_views(covered, scene.views, scene.images, no_margin, executor);
  ASSERT_TRUE(open.has_value() && faces.has_value());
  EXPECT_TRUE(faces->worth_splitting.empty());
  std::size_t hidden = 0;
  std::size_t makeshift = 0;
  for (std::size_t f = 0; f < ground.faces.size(); ++f) {
    ASSERT_EQ(open->of(f).size(), 1U);
    if (faces->of(f).empty()) {
      ++hidden;
    } else if (faces->of(f)[0].quality < 0.1F * open->of(f)[0].quality) {
      ++makeshift;
    }
  }
  EXPECT_GT(hidden, 40U);     // under the middle of the lid
  EXPECT_GT(makeshift, 5U);   // under its rim
  EXPECT_LT(makeshift, 80U);  // the rest lies in the open
}

TEST(FindFaceViews, NamesFacesThatAreSeenInPart) {
  const TriangleMesh mesh = square_mesh(3.0, 1, 0.0);  // beyond the picture on all sides
  PaintedScene scene;
  scene.add_view({0.0, 0.1, 2.0}, ground_color);
  SerialExecutor executor;
  const auto faces = find_face_views(mesh, scene.views, scene.images, {}, executor);
  ASSERT_TRUE(faces.has_value());
  EXPECT_TRUE(faces->entries.empty());
  EXPECT_EQ(faces->worth_splitting, (std::vector<std::uint32_t>{0, 1}));
}

TEST(FindFaceViews, RefusesPicturesOfAnotherSize) {
  PaintedScene scene;
  scene.add_view({0.0, 0.1, 1.5}, ground_color);
  scene.images.pictures[0].rgb = cv::Mat(10, 10, CV_8UC3, cv::Scalar(0, 0, 0));
  SerialExecutor executor;
  const auto faces =
      find_face_views(square_mesh(0.3, 2, 0.0), scene.views, scene.images, {}, executor);
  ASSERT_FALSE(faces.has_value());
  EXPECT_EQ(faces.error().code, ErrorCode::kInvalidArgument);
}

TEST(SilhouetteMask, MarksJumpsAndNotSlopes) {
  cv::Mat inverse_depth(20, 40, CV_32FC1);
  for (int x = 0; x < 40; ++x) {
    inverse_depth.col(x).setTo(x < 20 ? 0.5 + 0.002 * x : 0.3);
  }
  const cv::Mat mask = silhouette_mask(inverse_depth, 100.0, 2);
  EXPECT_EQ(mask.at<std::uint8_t>(10, 10), 0);
  EXPECT_EQ(mask.at<std::uint8_t>(10, 20), 255);
  EXPECT_EQ(mask.at<std::uint8_t>(10, 17), 255);
  EXPECT_EQ(mask.at<std::uint8_t>(10, 25), 0);
}

}  // namespace
}  // namespace trigmesh
