#include "sfm/surface/marching_cubes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "sfm/surface/cell_triangles.hpp"

namespace trigmesh {

namespace {

constexpr std::uint32_t kNoVertex = 0xFFFFFFFFU;
// Vertices keep this distance from the ends of their edge: no two fall together.
constexpr float kEndMargin = 0.02F;
constexpr float kUnknown = 2.0F;  // distances are at most 1
// A block with one layer before it and two behind it: what gradients at its far corners need.
constexpr int kPaddedEdge = kBlockEdge + 3;
// A block with the first layer of the next ones.
constexpr int kCornerEdge = kBlockEdge + 1;

using PaddedBlock = std::array<float, static_cast<std::size_t>(kPaddedEdge* kPaddedEdge* kPaddedEdge)>;

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
        const bool known =
            block != VoxelGrid::kNone && grid.block(block).weight[place.voxel] >= min_weight;
        padded[padded_index(x, y, z)] =
            known ? grid.block(block).distance[place.voxel] : kUnknown;
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

/// What one block contributes.
struct BlockSurface {
  std::vector<std::uint16_t> edges;  ///< 3 * voxel + axis of each vertex, rising
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::array<std::uint32_t, 3>> faces;  ///< vertices of the whole mesh
};

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
          const Eigen::Vector3i to =
              Eigen::Vector3i(x, y, z) + Eigen::Vector3i::Unit(axis);
          const float there = padded[padded_index(to.x(), to.y(), to.z())];
          if (!is_known(there) || (here < 0.0F) == (there < 0.0F)) {
            continue;
          }
          const float t = std::clamp(here / (here - there), kEndMargin, 1.0F - kEndMargin);
          const Eigen::Vector3f gradient = (1.0F - t) * gradient_at(padded, x, y, z) +
                                           t * gradient_at(padded, to.x(), to.y(), to.z());
          const Eigen::Vector3f in_voxels =
              Eigen::Vector3i(x, y, z).cast<float>() + t * Eigen::Vector3f::Unit(axis);
          surface.edges.push_back(static_cast<std::uint16_t>(3 * voxel + static_cast<std::size_t>(axis)));
          surface.positions.emplace_back(corner + in_voxels * voxel_size);
          surface.normals.emplace_back(gradient.norm() > 0.0F ? gradient.normalized()
                                                              : Eigen::Vector3f::UnitZ());
        }
      }
    }
  }
}

/// Vertex numbers on the edges that start at the corners of the cells of a block.
using CornerEdges =
    std::array<std::uint32_t, static_cast<std::size_t>(3 * kCornerEdge* kCornerEdge* kCornerEdge)>;

std::size_t corner_edge_index(int x, int y, int z, int axis) {
  return static_cast<std::size_t>(((z * kCornerEdge + y) * kCornerEdge + x) * 3 + axis);
}

void number_edges(const std::vector<BlockSurface>& surfaces,
                  const std::vector<std::uint32_t>& first_vertex,
                  const std::array<std::size_t, 27>& around,
                  CornerEdges& numbers) {
  numbers.fill(kNoVertex);
  for (int shift = 0; shift < 8; ++shift) {
    const Eigen::Vector3i offset(shift & 1, (shift >> 1) & 1, (shift >> 2) & 1);
    const std::size_t block =
        around[static_cast<std::size_t>(13 + offset.x() + 3 * offset.y() + 9 * offset.z())];
    if (block == VoxelGrid::kNone) {
      continue;
    }
    for (std::size_t k = 0; k < surfaces[block].edges.size(); ++k) {
      const int edge = surfaces[block].edges[k];
      const int voxel = edge / 3;
      const Eigen::Vector3i at =
          Eigen::Vector3i(voxel % 8, voxel / 8 % 8, voxel / 64) + kBlockEdge * offset;
      if (at.maxCoeff() < kCornerEdge) {
        numbers[corner_edge_index(at.x(), at.y(), at.z(), edge % 3)] =
            first_vertex[block] + static_cast<std::uint32_t>(k);
      }
    }
  }
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

void find_faces(const PaddedBlock& padded, const CornerEdges& numbers, BlockSurface& surface) {
  for (int z = 0; z < kBlockEdge; ++z) {
    for (int y = 0; y < kBlockEdge; ++y) {
      for (int x = 0; x < kBlockEdge; ++x) {
        for (const CellTriangle& triangle : cell_triangles(inside_corners(padded, x, y, z))) {
          std::array<std::uint32_t, 3> face{};
          for (std::size_t k = 0; k < 3; ++k) {
            const CellEdge edge = cell_edge(triangle[k]);
            face[k] = numbers[corner_edge_index(x + (edge.from & 1),
                                                y + ((edge.from >> 1) & 1),
                                                z + (edge.from >> 2),
                                                edge.axis)];
          }
          surface.faces.push_back(face);
        }
      }
    }
  }
}

/// Concatenates the blocks in order, giving each block's memory back.
TriangleMesh join(std::vector<BlockSurface>& surfaces) {
  std::size_t vertices = 0;
  std::size_t faces = 0;
  for (const BlockSurface& surface : surfaces) {
    vertices += surface.positions.size();
    faces += surface.faces.size();
  }
  TriangleMesh mesh;
  mesh.positions.reserve(vertices);
  mesh.normals.reserve(vertices);
  mesh.faces.reserve(faces);
  for (BlockSurface& surface : surfaces) {
    mesh.positions.insert(mesh.positions.end(), surface.positions.begin(), surface.positions.end());
    mesh.normals.insert(mesh.normals.end(), surface.normals.begin(), surface.normals.end());
    mesh.faces.insert(mesh.faces.end(), surface.faces.begin(), surface.faces.end());
    surface = BlockSurface();
  }
  return mesh;
}

}  // namespace

TriangleMesh extract_surface(const VoxelGrid& grid, float min_weight, Executor& executor) {
  std::vector<BlockSurface> surfaces(grid.size());
  const auto voxel_size = static_cast<float>(grid.voxel_size());
  executor.for_each_index(grid.size(), [&](std::size_t block) {
    PaddedBlock padded;
    load_padded(grid, grid.neighborhood(block), min_weight, padded);
    const Eigen::Vector3f corner = block_position(grid.key(block)).cast<float>() *
                                   (voxel_size * static_cast<float>(kBlockEdge));
    find_vertices(padded, corner, voxel_size, surfaces[block]);
  });
  std::vector<std::uint32_t> first_vertex(grid.size());
  std::uint32_t count = 0;
  for (std::size_t block = 0; block < grid.size(); ++block) {
    first_vertex[block] = count;
    count += static_cast<std::uint32_t>(surfaces[block].positions.size());
  }
  executor.for_each_index(grid.size(), [&](std::size_t block) {
    const std::array<std::size_t, 27> around = grid.neighborhood(block);
    PaddedBlock padded;
    load_padded(grid, around, min_weight, padded);
    CornerEdges numbers;
    number_edges(surfaces, first_vertex, around, numbers);
    find_faces(padded, numbers, surfaces[block]);
  });
  return join(surfaces);
}

}  // namespace trigmesh
