#include <random>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "sfm/texture/atlas_layout.hpp"
#include "sfm/texture/charts.hpp"
#include "sfm/texture/mesh_topology.hpp"
#include "sfm/texture/rectangle_packing.hpp"
#include "tests/unit/sfm/texture/painted_scene.hpp"

namespace trigmesh {
namespace {

TEST(PackRectangles, NeitherOverlapsNorLeavesThePage) {
  std::mt19937 generator(11);
  std::vector<RectangleSize> sizes(400);
  for (RectangleSize& size : sizes) {
    size = {1 + static_cast<int>(generator() % 40), 1 + static_cast<int>(generator() % 40)};
  }
  const auto packing = pack_rectangles(sizes, 256, 8);
  ASSERT_TRUE(packing.has_value());
  std::vector<cv::Mat> pages;
  for (int p = 0; p < packing->page_count; ++p) {
    pages.emplace_back(256, 256, CV_8UC1, cv::Scalar(0));
  }
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const RectanglePlace& place = packing->places[i];
    ASSERT_TRUE(place.x >= 0 && place.y >= 0 && place.x + sizes[i].width <= 256 &&
                place.y + sizes[i].height <= 256);
    cv::Mat area = pages[place.page](cv::Rect(place.x, place.y, sizes[i].width, sizes[i].height));
    ASSERT_EQ(cv::countNonZero(area), 0);
    area.setTo(1);
  }
  EXPECT_GT(cv::countNonZero(pages.front()), 256 * 256 * 8 / 10);
}

TEST(PackRectangles, SaysWhenItDoesNotFit) {
  EXPECT_FALSE(pack_rectangles(std::vector<RectangleSize>{{65, 1}}, 64, 4).has_value());
  EXPECT_FALSE(pack_rectangles(std::vector<RectangleSize>(3, {40, 40}), 64, 2).has_value());
  EXPECT_TRUE(pack_rectangles(std::vector<RectangleSize>(2, {40, 40}), 64, 2).has_value());
}

TEST(ConnectedCharts, SplitsByLabelAndConnection) {
  const FaceNeighbors neighbors = face_neighbors(square_mesh(1.0, 1, 0.0));
  EXPECT_EQ(connected_charts(std::vector<std::uint32_t>{4, 4}, neighbors).size(), 1U);
  EXPECT_EQ(connected_charts(std::vector<std::uint32_t>{4, 5}, neighbors).size(), 2U);
  EXPECT_EQ(connected_charts(std::vector<std::uint32_t>{4, kNoLabel}, neighbors).size(), 1U);
}

TEST(AbsorbSmallCharts, OnlyWhereTheOtherViewSeesTheFace) {
  const FaceNeighbors neighbors = face_neighbors(square_mesh(1.0, 1, 0.0));
  FaceViews faces;
  faces.entries = {{0, 1.0F, {}}, {0, 1.0F, {}}, {1, 2.0F, {}}};
  faces.offsets = {0, 1, 3};
  std::vector<std::uint32_t> labels{0, 1};
  absorb_small_charts(faces, neighbors, 1, labels);
  EXPECT_EQ(labels, (std::vector<std::uint32_t>{0, 0}));
}

TEST(LayOutAtlas, CornersLieInsideTheirChartAtPictureDensity) {
  const TriangleMesh mesh = square_mesh(0.5, 6, 0.0);
  PaintedScene scene;
  add_ring(scene, 2);
  std::vector<std::uint32_t> labels(mesh.faces.size(), 0);
  std::fill(labels.begin() + 30, labels.end(), 1);
  labels[5] = kNoLabel;
  const auto layout =
      lay_out_atlas(mesh, scene.views, labels, connected_charts(labels, face_neighbors(mesh)), {});
  ASSERT_TRUE(layout.has_value());
  EXPECT_LE(layout->page_size_px, 128);
  EXPECT_EQ(layout->texels_per_pixel, 1.0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Chart& chart = layout->charts[layout->face_chart[f]];
    EXPECT_EQ(chart.view, labels[f]);
    for (const Eigen::Vector2f& texel : layout->face_texels[f]) {
      EXPECT_GE(texel.x(), static_cast<float>(chart.page_x));
      EXPECT_GE(texel.y(), static_cast<float>(chart.page_y));
      EXPECT_LE(texel.x(), static_cast<float>(chart.page_x + chart.width - 1));
      EXPECT_LE(texel.y(), static_cast<float>(chart.page_y + chart.height - 1));
    }
  }
}

TEST(LayOutAtlas, LowersDensityUntilItFits) {
  const TriangleMesh mesh = square_mesh(0.5, 6, 0.0);
  PaintedScene scene;
  add_ring(scene, 1);
  const std::vector<std::uint32_t> labels(mesh.faces.size(), 0);
  AtlasOptions options;
  options.page_size_px = 64;
  options.max_pages = 1;
  options.padding_px = 8;
  const auto layout = lay_out_atlas(
      mesh, scene.views, labels, connected_charts(labels, face_neighbors(mesh)), options);
  ASSERT_TRUE(layout.has_value());
  EXPECT_LT(layout->texels_per_pixel, 1.0);
  EXPECT_GT(layout->texels_per_pixel, 0.5);
}

}  // namespace
}  // namespace trigmesh
