#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/dense/dense_cloud.hpp"
#include "sfm/scene/scene.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

// All writers make binary little endian files in the world frame. All readers take ASCII or binary
// little endian; properties may have any type and order, and what they do not know is skipped,
// lists and elements too. They give kUnsupported for big endian, kCorruptData for what is no PLY or
// contradicts itself; memory is bounded by a multiple of the file.

struct ColoredPoint {
  Eigen::Vector3f position_in_world = Eigen::Vector3f::Zero();
  std::array<std::uint8_t, 3> color_rgb{};

  bool operator==(const ColoredPoint&) const = default;
};

/// The landmarks of a scene, in their order.
[[nodiscard]] std::vector<ColoredPoint> colored_points(const Scene& scene);

/// float x y z, uchar red green blue.
[[nodiscard]] std::string write_ply(std::span<const ColoredPoint> points);

/// The vertices. Without colours (of an 8-bit type) points are white.
[[nodiscard]] Result<std::vector<ColoredPoint>> read_ply(std::string_view bytes);

/// float x y z nx ny nz, uchar red green blue, float confidence, ushort view_count: the first nine
/// in the order that COLMAP's fused.ply has.
[[nodiscard]] std::string write_dense_ply(std::span<const DensePoint> points);

/// Clouds of other programs too: without normals they are zero, without colours white, without a
/// confidence 1, without a view count 0. Values are finite, confidences in [0, 1].
[[nodiscard]] Result<DenseCloud> read_dense_ply(std::string_view bytes);

/// Vertices: float x y z, nx ny nz when the mesh has normals, uchar red green blue when it has
/// colours; faces: list uchar int vertex_indices. Precondition: normals and colours are empty or
/// one for each position.
[[nodiscard]] std::string write_mesh_ply(const TriangleMesh& mesh);

/// Normals and colours only where the file has all three of each (colours of an 8-bit type). A face
/// of more than three corners becomes a fan of triangles. kCorruptData for a face of fewer, and for
/// a vertex that does not exist.
[[nodiscard]] Result<TriangleMesh> read_mesh_ply(std::string_view bytes);

}  // namespace trigmesh
