#include "sfm/surface/marching_cubes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/surface/cell_triangles.hpp"

namespace trigmesh {

namespace {

// Vertices keep this distance from the ends of their edge: no two fall together.
constexpr float kEndMargin = 0.02F;
constexpr float kUnknown = 2.0F;  // distances are at most 1
// A block with one layer before it and two behind it: what gradients at its far corners need.
constexpr int kPaddedEdge = kBlockEdge + 3;
// A face names the edges of its vertices: 3 * voxel + axis, and above these bits which of the eight
// blocks the edge starts in: bit 0, 1, 2 = the next one along x, y, z.
constexpr int kEdgeBits = 11;
constexpr std::uint16_t kEdgeMask = (1U << kEdgeBits) - 1U;
static_assert(3 * kBlockVoxels <= std::size_t{1} << kEdgeBits);

using PaddedBlock =
    std::array<float, static_cast<std::size_t>(kPaddedEdge* kPaddedEdge* kPaddedEdge)>;

std::size_t padded_index(int x, int y, int z) {
  return static_cast<std::size_t>(((z + 1) * kPaddedEdge + y + 1) * kPaddedEdge + x + 1);
}

/// Where a voxel beside a block is: which of the 27 blocks, which voxel in it.
struct VoxelPlace {
  std::size_t neighbor;
  std::size_t voxel;
};

VoxelPlace place_of(int x, int y, int z) {
  const auto shift = [](int v) { return (v + kBlockEdge) / kBlockEdge; };
  const auto within = [](int v) { return (v + kBlockEdge) % kBlockEdge; };
  return {static_cast<std::size_t>(shift(x) + 3 * shift(y) + 9 * shift(z)),
          static_cast<std::size_t>(within(x) + kBlockEdge * (within(y) + kBlockEdge * within(z)))};
}

/// Distances of a block and the layers around it; kUnknown where nothing is known.
void load_padded(const VoxelGrid& grid,
                 const std::array<std::size_t, 27>& around,
                 float min_weight,
                 PaddedBlock& padded) {
  for (int z = -1; z <= kBlockEdge + 1; ++z) {
    for (int y = -1; y <= kBlockEdge + 1; ++y) {
      for (int x = -1; x <= kBlockEdge + 1; ++x) {
        const VoxelPlace place = place_of(x, y, z);
        const std::size_t block = around[place.neighbor];
        const bool known = block != kNoBlock && grid.block(block).weight[place.voxel] >= min_weight;
        padded[padded_index(x, y, z)] = known ? grid.block(block).distance[place.voxel] : kUnknown;
      }
    }
  }
}

bool is_known(float distance) {
  return distance < kUnknown;
}

/// Central differences where both sides are known, else one-sided.
Eigen::Vector3f gradient_at(const PaddedBlock& padded, int x, int y, int z) {
  Eigen::Vector3f gradient = Eigen::Vector3f::Zero();
  const float center = padded[padded_index(x, y, z)];
  for (int axis = 0; axis < 3; ++axis) {
    const int dx = axis == 0 ? 1 : 0;
    const int dy = axis == 1 ? 1 : 0;
    const int dz = axis == 2 ? 1 : 0;
    const float before = padded[padded_index(x - dx, y - dy, z - dz)];
    const float after = padded[padded_index(x + dx, y + dy, z + dz)];
    if (is_known(before) && is_known(after)) {
      gradient[axis] = 0.5F * (after - before);
    } else if (is_known(after)) {
      gradient[axis] = after - center;
    } else if (is_known(before)) {
      gradient[axis] = center - before;
    }
  }
  return gradient;
}

/// A vertex on each voxel edge of the block that the surface crosses.
void find_vertices(const PaddedBlock& padded,
                   const Eigen::Vector3f& corner,
                   float voxel_size,
                   BlockSurface& surface) {
  std::size_t voxel = 0;
  for (int z = 0; z < kBlockEdge; ++z) {
    for (int y = 0; y < kBlockEdge; ++y) {
      for (int x = 0; x < kBlockEdge; ++x, ++voxel) {
        const float here = padded[padded_index(x, y, z)];
        for (int axis = 0; axis < 3 && is_known(here); ++axis) {
          const Eigen::Vector3i to = Eigen::Vector3i(x, y, z) + Eigen::Vector3i::Unit(axis);
          const float there = padded[padded_index(to.x(), to.y(), to.z())];
          if (!is_known(there) || (here < 0.0F) == (there < 0.0F)) {
            continue;
          }
          const float t = std::clamp(here / (here - there), kEndMargin, 1.0F - kEndMargin);
          const Eigen::Vector3f gradient = (1.0F - t) * gradient_at(padded, x, y, z) +
                                           t * gradient_at(padded, to.x(), to.y(), to.z());
          const Eigen::Vector3f in_voxels =
              Eigen::Vector3i(x, y, z).cast<float>() + t * Eigen::Vector3f::Unit(axis);
          surface.edges.push_back(
              static_cast<std::uint16_t>(3 * voxel + static_cast<std::size_t>(axis)));
          surface.positions.emplace_back(corner + in_voxels * voxel_size);
          surface.normals.emplace_back(gradient.norm() > 0.0F ? gradient.normalized()
                                                              : Eigen::Vector3f::UnitZ());
        }
      }
    }
  }
}

/// The name of an edge of the cell (x, y, z) of a block.
std::uint16_t name_of(const CellEdge& edge, int x, int y, int z) {
  const Eigen::Vector3i at(
      x + (edge.from & 1), y + ((edge.from >> 1) & 1), z + ((edge.from >> 2) & 1));
  const Eigen::Vector3i shift = at / kBlockEdge;
  const Eigen::Vector3i within = at - kBlockEdge * shift;
  const int voxel = within.x() + kBlockEdge * (within.y() + kBlockEdge * within.z());
  const int block = shift.x() + 2 * shift.y() + 4 * shift.z();
  return static_cast<std::uint16_t>((block << kEdgeBits) | (3 * voxel + edge.axis));
}

/// Which corners of a cell are inside; nothing (0) when one of them is unknown.
std::uint8_t inside_corners(const PaddedBlock& padded, int x, int y, int z) {
  std::uint8_t inside = 0;
  for (int c = 0; c < 8; ++c) {
    const float d = padded[padded_index(x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2))];
    if (!is_known(d)) {
      return 0;
    }
    inside = static_cast<std::uint8_t>(inside | ((d < 0.0F ? 1 : 0) << c));
  }
  return inside;
}

void find_faces(const PaddedBlock& padded, BlockSurface& surface) {
  for (int z = 0; z < kBlockEdge; ++z) {
    for (int y = 0; y < kBlockEdge; ++y) {
      for (int x = 0; x < kBlockEdge; ++x) {
        for (const CellTriangle& triangle : cell_triangles(inside_corners(padded, x, y, z))) {
          surface.faces.push_back({name_of(cell_edge(triangle[0]), x, y, z),
                                   name_of(cell_edge(triangle[1]), x, y, z),
                                   name_of(cell_edge(triangle[2]), x, y, z)});
        }
      }
    }
  }
}

/// Number of the first vertex and face of each block, and behind the last.
struct FirstNumbers {
  std::vector<std::uint32_t> vertex{0};
  std::vector<std::size_t> face{0};

  explicit FirstNumbers(std::span<const BlockSurface> surfaces) {
    for (const BlockSurface& surface : surfaces) {
      vertex.push_back(vertex.back() + static_cast<std::uint32_t>(surface.edges.size()));
      face.push_back(face.back() + surface.faces.size());
    }
  }
};

/// The faces of a block with vertices of the whole mesh: welded by the integer names of their
/// edges.
void number_faces(std::span<const BlockKey> keys,
                  std::span<const BlockSurface> surfaces,
                  const FirstNumbers& first,
                  std::size_t block,
                  TriangleMesh& mesh) {
  const std::array<std::size_t, 27> around = blocks_around(keys, keys[block]);
  const auto number_of = [&](std::uint16_t name) {
    const int shift = name >> kEdgeBits;
    const std::size_t owner = around[static_cast<std::size_t>(
        13 + (shift & 1) + 3 * ((shift >> 1) & 1) + 9 * (shift >> 2))];
    TM_CHECK(owner != kNoBlock);
    const std::vector<std::uint16_t>& edges = surfaces[owner].edges;
    const auto edge = static_cast<std::uint16_t>(name & kEdgeMask);
    const auto place = std::lower_bound(edges.begin(), edges.end(), edge);
    TM_CHECK(place != edges.end() && *place == edge);
    return first.vertex[owner] + static_cast<std::uint32_t>(place - edges.begin());
  };
  for (std::size_t f = 0; f < surfaces[block].faces.size(); ++f) {
    const auto& face = surfaces[block].faces[f];
    mesh.faces[first.face[block] + f] = {
        number_of(face[0]), number_of(face[1]), number_of(face[2])};
  }
}

/// Moves one kind of items of all blocks into one list, giving the blocks' memory back.
template <typename T>
std::vector<T> take_all(std::vector<T> BlockSurface::*part,
                        std::size_t count,
                        std::span<BlockSurface> surfaces) {
  std::vector<T> all;
  all.reserve(count);
  for (BlockSurface& surface : surfaces) {
    all.insert(all.end(), (surface.*part).begin(), (surface.*part).end());
    surface.*part = {};
  }
  return all;
}

}  // namespace

BlockSurface extract_block(const VoxelGrid& grid, std::size_t block, float min_weight) {
  const auto voxel_size = static_cast<float>(grid.voxel_size());
  PaddedBlock padded;
  load_padded(grid, blocks_around(grid.keys(), grid.key(block)), min_weight, padded);
  const Eigen::Vector3f corner =
      block_position(grid.key(block)).cast<float>() * (voxel_size * static_cast<float>(kBlockEdge));
  BlockSurface surface;
  find_vertices(padded, corner, voxel_size, surface);
  find_faces(padded, surface);
  surface.shrink();
  return surface;
}

TriangleMesh join_blocks(std::span<const BlockKey> keys,
                         std::vector<BlockSurface> surfaces,
                         Executor& executor) {
  TM_CHECK(keys.size() == surfaces.size());
  const FirstNumbers first(surfaces);
  TriangleMesh mesh;
  mesh.positions = take_all(&BlockSurface::positions, first.vertex.back(), surfaces);
  mesh.normals = take_all(&BlockSurface::normals, first.vertex.back(), surfaces);
  mesh.faces.resize(first.face.back());
  executor.for_each_index(
      keys.size(), [&](std::size_t block) { number_faces(keys, surfaces, first, block, mesh); });
  return mesh;
}

TriangleMesh extract_surface(const VoxelGrid& grid, float min_weight, Executor& executor) {
  std::vector<BlockSurface> surfaces(grid.size());
  executor.for_each_index(grid.size(), [&](std::size_t block) {
    surfaces[block] = extract_block(grid, block, min_weight);
  });
  return join_blocks(grid.keys(), std::move(surfaces), executor);
}

}  // namespace trigmesh
