#include "sfm/surface/cell_triangles.hpp"

#include <algorithm>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

constexpr std::size_t kCases = 256;
constexpr std::uint8_t kNoEdge = 255;

using Table = std::array<std::vector<CellTriangle>, kCases>;

int bit(int corner, int axis) {
  return (corner >> axis) & 1;
}

std::uint8_t edge_between(int a, int b) {
  for (std::size_t e = 0; e < kCellEdges; ++e) {
    const CellEdge edge = cell_edge(e);
    if (edge.from == std::min(a, b) && (edge.from | (1 << edge.axis)) == std::max(a, b)) {
      return static_cast<std::uint8_t>(e);
    }
  }
  TM_CHECK(false);
  return kNoEdge;
}

/// Corners of a face, counter-clockwise seen from outside the cell.
std::array<int, 4> face_corners(int axis, int side) {
  const int b = 1 << ((axis + 1) % 3);
  const int c = 1 << ((axis + 2) % 3);
  const int base = side << axis;
  if (side == 1) {
    return {base, base | b, base | b | c, base | c};
  }
  return {base, base | c, base | b | c, base | b};
}

/// For each crossed edge the next one of its loop.
std::array<std::uint8_t, kCellEdges> link_segments(std::uint8_t inside) {
  std::array<std::uint8_t, kCellEdges> next{};
  next.fill(kNoEdge);
  const auto is_inside = [&](int corner) { return ((inside >> corner) & 1) != 0; };
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> corners = face_corners(face / 2, face % 2);
    for (std::size_t enter = 0; enter < 4; ++enter) {
      if (is_inside(corners[enter]) || !is_inside(corners[(enter + 1) % 4])) {
        continue;
      }
      std::size_t leave = (enter + 1) % 4;
      while (is_inside(corners[(leave + 1) % 4])) {
        leave = (leave + 1) % 4;
      }
      next[edge_between(corners[enter], corners[(enter + 1) % 4])] =
          edge_between(corners[leave], corners[(leave + 1) % 4]);
    }
  }
  return next;
}

/// Whether two edges lie on one face: a segment between them could be a neighbour's too.
bool share_face(std::uint8_t a, std::uint8_t b) {
  const CellEdge first = cell_edge(a);
  const CellEdge second = cell_edge(b);
  for (int axis = 0; axis < 3; ++axis) {
    if (axis != first.axis && axis != second.axis &&
        bit(first.from, axis) == bit(second.from, axis)) {
      return true;
    }
  }
  return false;
}

/// Cuts ears whose diagonal is inside the cell, trying all of them.
bool cut_ears(const std::vector<std::uint8_t>& loop, std::vector<CellTriangle>& triangles) {
  if (loop.size() == 3) {
    triangles.push_back({loop[0], loop[1], loop[2]});
    return true;
  }
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const std::uint8_t before = loop[(i + loop.size() - 1) % loop.size()];
    const std::uint8_t after = loop[(i + 1) % loop.size()];
    if (share_face(before, after)) {
      continue;
    }
    std::vector<std::uint8_t> rest = loop;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
    triangles.push_back({before, loop[i], after});
    if (cut_ears(rest, triangles)) {
      return true;
    }
    triangles.pop_back();
  }
  return false;
}

std::vector<CellTriangle> triangulate(std::uint8_t inside) {
  std::array<std::uint8_t, kCellEdges> next = link_segments(inside);
  std::vector<CellTriangle> triangles;
  for (std::size_t start = 0; start < kCellEdges; ++start) {
    std::vector<std::uint8_t> loop;
    for (auto e = static_cast<std::uint8_t>(start); next[e] != kNoEdge;) {
      loop.push_back(e);
      const std::uint8_t following = next[e];
      next[e] = kNoEdge;
      e = following;
    }
    if (!loop.empty()) {
      TM_CHECK(cut_ears(loop, triangles));
    }
  }
  return triangles;
}

Table make_table() {
  Table table;
  for (std::size_t inside = 0; inside < kCases; ++inside) {
    table[inside] = triangulate(static_cast<std::uint8_t>(inside));
  }
  return table;
}

}  // namespace

CellEdge cell_edge(std::size_t edge) {
  const int axis = static_cast<int>(edge / 4);
  const int k = static_cast<int>(edge % 4);
  const int low = k & ((1 << axis) - 1);
  return {((k >> axis) << (axis + 1)) | low, axis};
}

const std::vector<CellTriangle>& cell_triangles(std::uint8_t inside) {
  static const Table kTable = make_table();
  return kTable[inside];
}

}  // namespace trigmesh
