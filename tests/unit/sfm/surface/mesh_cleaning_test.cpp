#include "sfm/surface/mesh_cleaning.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace trigmesh
