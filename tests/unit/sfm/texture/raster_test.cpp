#include "sfm/texture/raster.hpp"

#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core/mat.hpp>

#include "sfm/texture/image_similarity.hpp"
#include "sfm/texture/mesh_projection.hpp"
#include "sfm/texture/mesh_topology.hpp"
#include "tests/unit/sfm/texture/painted_scene.hpp"

namespace trigmesh {
namespace {

TEST(RasterizeTriangle, NeighboursShareNoPixelAndLeaveNone) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<float> coordinate(4.0F, 28.0F);
  for (int round = 0; round < 50; ++round) {
    const std::array<Eigen::Vector2f, 4> border{Eigen::Vector2f(0.0F, 0.0F),
                                                Eigen::Vector2f(31.0F, 0.0F),
                                                Eigen::Vector2f(31.0F, 31.0F),
                                                Eigen::Vector2f(0.0F, 31.0F)};
    const Eigen::Vector2f middle(coordinate(generator), coordinate(generator));
    std::vector<int> hits(32 * 32, 0);
    for (std::size_t i = 0; i < 4; ++i) {
      rasterize_triangle({border[i], middle, border[(i + 1) % 4]},
                         {32, 32},
                         [&](int x, int y, const Eigen::Vector3f&) {
                           ++hits[static_cast<std::size_t>(y * 32 + x)];
                         });
    }
    for (int y = 1; y < 31; ++y) {
      for (int x = 1; x < 31; ++x) {
        ASSERT_EQ(hits[static_cast<std::size_t>(y * 32 + x)], 1) << x << ' ' << y;
      }
    }
  }
}

TEST(RasterizeTriangle, WeightsGiveThePixelBack) {
  const std::array<Eigen::Vector2f, 3> corners{
      Eigen::Vector2f(1.5F, 2.25F), Eigen::Vector2f(20.0F, 5.0F), Eigen::Vector2f(8.0F, 18.5F)};
  int count = 0;
  rasterize_triangle(corners, {15, 12}, [&](int x, int y, const Eigen::Vector3f& w) {
    const Eigen::Vector2f p = w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2];
    EXPECT_NEAR(p.x(), static_cast<float>(x), 1e-3F);
    EXPECT_NEAR(p.y(), static_cast<float>(y), 1e-3F);
    EXPECT_TRUE(x >= 0 && x < 15 && y >= 0 && y < 12);
    ++count;
  });
  EXPECT_GT(count, 50);
}

TEST(RenderInverseDepth, NearestFaceWins) {
  TriangleMesh mesh = square_mesh(1.0, 2, 0.0);
  append(mesh, square_mesh(0.2, 1, 1.0));
  const Rigid3 cam_from_world = looking_at({0.0, 0.0, 3.0}, Eigen::Vector3d::Zero());
  const cv::Mat depth =
      render_inverse_depth(mesh, project_mesh(mesh, small_camera(), cam_from_world), {120, 90});
  EXPECT_NEAR(depth.at<float>(44, 59), 1.0F / 2.0F, 1e-4F);
  EXPECT_NEAR(depth.at<float>(44, 80), 1.0F / 3.0F, 1e-4F);
  EXPECT_EQ(depth.at<float>(2, 2), 0.0F);
}

TEST(FaceNeighbors, KnowsBordersAndLeavesEdgesOfThreeFacesOut) {
  TriangleMesh mesh = square_mesh(1.0, 1, 0.0);
  auto neighbors = face_neighbors(mesh);
  EXPECT_EQ(neighbors[0], (std::array<std::uint32_t, 3>{kNoFace, kNoFace, 1}));
  EXPECT_EQ(neighbors[1], (std::array<std::uint32_t, 3>{0, kNoFace, kNoFace}));
  mesh.positions.emplace_back(0.0F, 0.0F, 1.0F);
  mesh.faces.push_back({0, 3, 4});
  neighbors = face_neighbors(mesh);
  EXPECT_EQ(neighbors[0][2], kNoFace);
}

TEST(CompareImages, KnowsEqualAndKnownDifference) {
  cv::Mat a(40, 40, CV_8UC3, cv::Scalar(100, 100, 100));
  cv::Mat b(40, 40, CV_8UC3, cv::Scalar(110, 110, 110));
  cv::Mat coverage(40, 40, CV_8UC1, cv::Scalar(255));
  coverage.row(0).setTo(0);
  const ImageSimilarity equal = compare_images(a, a, coverage);
  EXPECT_EQ(equal.psnr_db, 100.0);
  EXPECT_NEAR(equal.ssim, 1.0, 1e-5);
  EXPECT_EQ(equal.pixel_count, 39U * 40U);
  EXPECT_NEAR(compare_images(a, b, coverage).psnr_db, 20.0 * std::log10(25.5), 1e-9);
  coverage.setTo(0);
  EXPECT_EQ(compare_images(a, b, coverage).pixel_count, 0U);
}

}  // namespace
}  // namespace trigmesh
