#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace trigmesh {

/// A triangle surface in the world frame. Plain data.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;             ///< per vertex, unit, outwards; or empty
  std::vector<std::array<std::uint8_t, 3>> colors;  ///< per vertex, red green blue; or empty
  std::vector<std::array<std::uint32_t, 3>>
      faces;  ///< vertices, counter-clockwise seen from outside
};

}  // namespace trigmesh
