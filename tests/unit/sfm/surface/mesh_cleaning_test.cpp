#include "sfm/surface/mesh_cleaning.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "sfm/surface/mesh_fitting.hpp"
#include "sfm/surface/mesh_flipping.hpp"
#include "sfm/surface/mesh_simplification.hpp"
#include "sfm/surface/mesh_topology.hpp"
#include "tests/unit/sfm/surface/mesh_examples.hpp"

namespace trigmesh {
namespace {

TEST(MeshCleaning, RemovesSmallComponentsOnly) {
  TriangleMesh mesh = test::join(test::make_sheet(1, 50.0F), test::make_sheet(20));
  const RemovedComponents removed = remove_small_components(0.01, mesh);
  EXPECT_EQ(removed.components, 1U);
  EXPECT_EQ(removed.faces, 2U);
  EXPECT_EQ(mesh.faces.size(), 800U);
  EXPECT_EQ(mesh.positions.size(), 441U);
}

TEST(MeshCleaning, RemovesWhatFewViewsSupport) {
  TriangleMesh mesh = test::make_sheet(2);
  std::vector<std::uint16_t> support(9, 5);
  support[0] = support[1] = support[3] = support[4] = 1;
  EXPECT_EQ(remove_unsupported(support, 2, mesh), 4U);
  EXPECT_EQ(mesh.faces.size(), 4U);
}

TEST(MeshCleaning, FlattensASpike) {
  TriangleMesh mesh = test::make_sheet(4);
  mesh.positions[12].z() = 3.0F;
  EXPECT_EQ(flatten_spikes(1.5F, mesh), 1U);
  EXPECT_FLOAT_EQ(mesh.positions[12].z(), 0.0F);
}

TEST(MeshSimplification, KeepsAFlatSheetAndItsBorder) {
  TriangleMesh mesh = test::make_sheet(30);
  const double error = simplify(400, mesh);
  EXPECT_LE(mesh.faces.size(), 400U);
  EXPECT_LT(error, 1e-2);
  EXPECT_EQ(mesh.colors.size(), mesh.positions.size());
  double area = 0.0;
  for (const double a : find_components(mesh).areas) {
    area += a;
  }
  EXPECT_NEAR(area, 900.0, 0.1);
}

TEST(MeshSimplification, KeepsASurfaceFullOfThinWallsTwoManifoldAndClosed) {
  SerialExecutor serial;
  TriangleMesh mesh = extract_surface(test::make_noise(7), 0.5F, serial);
  simplify(mesh.faces.size() / 8, mesh);
  ASSERT_GT(mesh.faces.size(), 1000U);
  EXPECT_TRUE(test::is_two_manifold(mesh));
  EXPECT_EQ(analyze_topology(mesh).boundary_edges, 0U);
}

TEST(MeshSimplification, AveragesNoiseInsteadOfPickingIt) {
  TriangleMesh mesh = test::make_sheet(60);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> noise(-0.3F, 0.3F);
  for (Eigen::Vector3f& p : mesh.positions) {
    p.z() = noise(random);
  }
  simplify(400, mesh);
  double sum = 0.0;
  for (const Eigen::Vector3f& p : mesh.positions) {
    sum += static_cast<double>(p.z() * p.z());
  }
  // The noise has a deviation of 0.17; QEM prefers its extremes.
  EXPECT_LT(std::sqrt(sum / static_cast<double>(mesh.positions.size())), 0.12);
}

TEST(MeshFitting, KeepsSharpEdgesAndBorders) {
  // A roof: two slopes that meet at x = 10. Only the four corners and the ridge's ends are used,
  // and one point in the middle of the ridge.
  TriangleMesh mesh = test::make_sheet(20);
  for (Eigen::Vector3f& p : mesh.positions) {
    p.z() = -std::abs(p.x() - 10.0F);
  }
  const auto fine = mesh.faces;
  const auto at = [](std::uint32_t x, std::uint32_t y) { return y * 21 + x; };
  mesh.faces = {{at(0, 0), at(10, 0), at(10, 10)},
                {at(0, 0), at(10, 10), at(0, 20)},
                {at(0, 20), at(10, 10), at(10, 20)},
                {at(10, 0), at(20, 0), at(10, 10)},
                {at(20, 0), at(20, 20), at(10, 10)},
                {at(20, 20), at(10, 20), at(10, 10)}};
  const std::vector<Eigen::Vector3f> before = mesh.positions;
  fit_to_fine_surface(fine, mesh);
  for (const std::uint32_t v :
       {at(0, 0), at(10, 0), at(20, 0), at(0, 20), at(10, 20), at(20, 20)}) {
    EXPECT_EQ(mesh.positions[v], before[v]);
  }
  EXPECT_LT((mesh.positions[at(10, 10)] - before[at(10, 10)]).norm(), 1e-3F);
}

TEST(MeshCleaning, SmoothsTheTeethOfABorder) {
  TriangleMesh mesh = test::make_sheet(20);
  for (std::uint32_t x = 2; x < 19; x += 2) {
    mesh.positions[x].y() = 0.6F;
  }
  smooth_borders(10, mesh);
  for (std::uint32_t x = 5; x < 16; ++x) {
    EXPECT_NEAR(mesh.positions[x].y(), 0.3F, 0.1F);
  }
  EXPECT_EQ(mesh.positions[5 * 21 + 5], Eigen::Vector3f(5, 5, 0));
}

TEST(MeshFlipping, TurnsAFoldOfTwoSlivers) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {4, 0, 0}, {2, 0.3F, 0.3F}, {2, -0.3F, 0.3F}};
  mesh.faces = {{0, 1, 2}, {1, 0, 3}};
  EXPECT_EQ(flip_slivers(mesh), 1U);
  EXPECT_TRUE(test::is_two_manifold(mesh));
  for (const Eigen::Vector3f& normal : vertex_normals(mesh)) {
    EXPECT_GT(normal.z(), 0.9F);
  }
}

TEST(MeshFlipping, KeepsARidge) {
  TriangleMesh mesh = test::make_sheet(20);
  for (Eigen::Vector3f& p : mesh.positions) {
    p.y() += 0.7F * p.x();
    p.z() = -std::abs(p.x() - 10.0F);
  }
  EXPECT_EQ(flip_slivers(mesh), 0U);
}

TEST(MeshTopology, NormalsDoNotDependOnHowASideIsCut) {
  // A corner of a cube whose side x = 0 is cut into many triangles around the corner.
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.faces = {{0, 2, 1}, {0, 1, 3}};
  std::uint32_t before = 3;
  for (int step = 1; step <= 9; ++step) {
    const float angle = static_cast<float>(step) / 9.0F * 1.5707964F;
    mesh.positions.emplace_back(0.0F, std::sin(angle), std::cos(angle));
    const auto added = static_cast<std::uint32_t>(mesh.positions.size() - 1);
    mesh.faces.push_back({0, before, added});
    before = added;
  }
  const Eigen::Vector3f expected = Eigen::Vector3f(-1, -1, -1).normalized();
  EXPECT_LT((vertex_normals(mesh)[0] - expected).norm(), 1e-4F);
}

}  // namespace
}  // namespace trigmesh
