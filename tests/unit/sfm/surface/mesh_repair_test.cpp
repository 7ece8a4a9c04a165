#include "sfm/surface/mesh_repair.hpp"

#include <gtest/gtest.h>

#include "sfm/surface/mesh_topology.hpp"
#include "tests/unit/sfm/surface/mesh_examples.hpp"

namespace trigmesh {
namespace {

/// A closed tetrahedron; it faces outwards when the normal of the first three vertices points away
/// from the last.
void add_tetrahedron(const std::array<std::uint32_t, 4>& v, TriangleMesh& mesh) {
  mesh.faces.push_back({v[0], v[1], v[2]});
  mesh.faces.push_back({v[0], v[3], v[1]});
  mesh.faces.push_back({v[1], v[3], v[2]});
  mesh.faces.push_back({v[2], v[3], v[0]});
}

TEST(MeshRepair, LeavesAWholeMeshAsItIs) {
  TriangleMesh mesh = test::make_sheet(5);
  const TriangleMesh before = mesh;
  const RepairedMesh repaired = make_two_manifold(mesh);
  EXPECT_EQ(repaired.dropped_faces + repaired.split_vertices + repaired.split_edges, 0U);
  EXPECT_EQ(mesh.faces, before.faces);
  EXPECT_EQ(mesh.positions, before.positions);
}

TEST(MeshRepair, TakesBodiesApartThatTouchAlongAnEdge) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0.5}, {1, 1, 0.5}, {-1, 0, 0.5}, {-1, -1, 0.5}};
  add_tetrahedron({1, 0, 2, 3}, mesh);
  add_tetrahedron({1, 0, 4, 5}, mesh);
  ASSERT_EQ(analyze_topology(mesh).non_manifold_edges, 1U);
  const RepairedMesh repaired = make_two_manifold(mesh);
  EXPECT_EQ(repaired.split_vertices, 2U);
  EXPECT_EQ(mesh.faces.size(), 8U);
  EXPECT_TRUE(test::is_two_manifold(mesh));
  EXPECT_EQ(analyze_topology(mesh).boundary_edges, 0U);
  EXPECT_EQ(find_components(mesh).areas.size(), 2U);
}

TEST(MeshRepair, TakesFansApartThatTouchInAVertex) {
  TriangleMesh mesh = test::make_sheet(2);
  std::vector<std::uint8_t> keep(8, 0);
  keep[0] = keep[1] = keep[6] = keep[7] = 1;  // two squares across from each other
  keep_faces(keep, mesh);
  ASSERT_EQ(mesh.positions.size(), 7U);
  EXPECT_EQ(make_two_manifold(mesh).split_vertices, 1U);
  EXPECT_TRUE(test::is_two_manifold(mesh));
  EXPECT_EQ(mesh.positions.size(), 8U);
  EXPECT_EQ(mesh.colors.size(), 8U);
  EXPECT_EQ(mesh.normals.size(), 8U);
}

TEST(MeshRepair, DropsDegenerateAndBackToBackFaces) {
  TriangleMesh mesh = test::make_sheet(1);
  const auto face = mesh.faces[0];
  mesh.positions.emplace_back(0.0F, 0.0F, 5.0F);
  mesh.faces.push_back({0, 1, 1});
  mesh.faces.push_back(face);  // repeated: one stays
  const std::uint32_t apex = 4;
  mesh.faces.push_back({0, 2, apex});
  mesh.faces.push_back({2, 0, apex});
  mesh.colors.push_back({1, 2, 3});
  mesh.normals.emplace_back(Eigen::Vector3f::UnitZ());
  EXPECT_EQ(make_two_manifold(mesh).dropped_faces, 4U);
  EXPECT_EQ(mesh.faces.size(), 2U);
  EXPECT_EQ(mesh.positions.size(), 4U);
  EXPECT_TRUE(test::is_two_manifold(mesh));
}

TEST(MeshRepair, CutsTheSecondEdgeOfAPinchedTunnel) {
  // A ring of which one cross-section is pinched to the edge 0-1: two edges on the same vertices,
  // yet a single fan around each of them.
  constexpr std::uint32_t kSections = 6;
  TriangleMesh mesh;
  const auto vertex = [&](std::uint32_t section, std::uint32_t side) {
    return (section % kSections) * 4 + side % 4;
  };
  for (std::uint32_t s = 0; s < kSections; ++s) {
    const float turn = 6.2831853F * static_cast<float>(s) / static_cast<float>(kSections);
    const Eigen::Vector3f out(std::cos(turn), std::sin(turn), 0.0F);
    mesh.positions.emplace_back(3.0F * out);
    mesh.positions.emplace_back(2.0F * out + Eigen::Vector3f::UnitZ());
    mesh.positions.emplace_back(1.0F * out);
    mesh.positions.emplace_back(2.0F * out - Eigen::Vector3f::UnitZ());
    for (std::uint32_t k = 0; k < 4; ++k) {
      mesh.faces.push_back({vertex(s, k), vertex(s + 1, k), vertex(s + 1, k + 1)});
      mesh.faces.push_back({vertex(s, k), vertex(s + 1, k + 1), vertex(s, k + 1)});
    }
  }
  ASSERT_TRUE(test::is_two_manifold(mesh));
  for (auto& face : mesh.faces) {  // the sides 2 and 3 of the first section fall on 1 and 0
    for (std::uint32_t& v : face) {
      v = v == 2 ? 1 : v == 3 ? 0 : v;
    }
  }
  const RepairedMesh repaired = make_two_manifold(mesh);
  EXPECT_GT(repaired.split_vertices + repaired.split_edges, 0U);
  EXPECT_TRUE(test::is_two_manifold(mesh));
  EXPECT_EQ(analyze_topology(mesh).boundary_edges, 0U);
}

TEST(MeshRepair, MakesRandomTrianglesTwoManifold) {
  std::mt19937 random(3);
  TriangleMesh mesh;
  for (int v = 0; v < 12; ++v) {
    mesh.positions.emplace_back(static_cast<float>(random() % 100U),
                                static_cast<float>(random() % 100U),
                                static_cast<float>(random() % 100U));
  }
  for (int f = 0; f < 200; ++f) {
    mesh.faces.push_back({static_cast<std::uint32_t>(random() % 12U),
                          static_cast<std::uint32_t>(random() % 12U),
                          static_cast<std::uint32_t>(random() % 12U)});
  }
  make_two_manifold(mesh);
  EXPECT_GT(mesh.faces.size(), 60U);
  EXPECT_TRUE(test::is_two_manifold(mesh));
}

}  // namespace
}  // namespace trigmesh
