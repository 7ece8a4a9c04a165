#include "sfm/surface/cell_triangles.hpp"

#include <map>
#include <utility>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

bool inside(std::size_t corners, int corner) {
  return ((corners >> corner) & 1U) != 0;
}

bool on_face(std::size_t edge, int axis, int side) {
  const CellEdge e = cell_edge(edge);
  return e.axis != axis && ((e.from >> axis) & 1) == side;
}

TEST(CellTriangles, UseExactlyTheCrossedEdgesInAllCases) {
  for (std::size_t corners = 0; corners < 256; ++corners) {
    std::array<bool, kCellEdges> used{};
    for (const CellTriangle& t : cell_triangles(static_cast<std::uint8_t>(corners))) {
      for (const std::uint8_t e : t) {
        used[e] = true;
      }
    }
    for (std::size_t e = 0; e < kCellEdges; ++e) {
      const CellEdge edge = cell_edge(e);
      EXPECT_EQ(used[e], inside(corners, edge.from) != inside(corners, edge.from | 1 << edge.axis));
    }
  }
}

TEST(CellTriangles, HaveTheirOpenEdgesOnFacesAndOthersInPairsInAllCases) {
  for (std::size_t corners = 0; corners < 256; ++corners) {
    std::map<std::pair<int, int>, int> directed;
    for (const CellTriangle& t : cell_triangles(static_cast<std::uint8_t>(corners))) {
      for (std::size_t k = 0; k < 3; ++k) {
        ++directed[{t[k], t[(k + 1) % 3]}];
      }
    }
    for (const auto& [edge, count] : directed) {
      EXPECT_EQ(count, 1);
      const auto a = static_cast<std::size_t>(edge.first);
      const auto b = static_cast<std::size_t>(edge.second);
      int faces = 0;
      for (int face = 0; face < 6; ++face) {
        faces += on_face(a, face / 2, face % 2) && on_face(b, face / 2, face % 2) ? 1 : 0;
      }
      const bool paired = directed.count({edge.second, edge.first}) == 1;
      EXPECT_NE(paired, faces > 0) << "case " << corners;
    }
  }
}

TEST(CellTriangles, FaceOutwardsAtASingleCorner) {
  const auto& triangles = cell_triangles(1);
  ASSERT_EQ(triangles.size(), 1U);
  // x, y, z in turn: normal (1, 1, 1), away from the corner at the origin.
  std::array<int, 3> axes{};
  for (std::size_t k = 0; k < 3; ++k) {
    axes[k] = cell_edge(triangles[0][k]).axis;
  }
  EXPECT_EQ((axes[1] - axes[0] + 3) % 3, 1);
  EXPECT_EQ((axes[2] - axes[1] + 3) % 3, 1);
}

}  // namespace
}  // namespace trigmesh
