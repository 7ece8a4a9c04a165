#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace trigmesh {

/// One point of the dense cloud.
struct DensePoint {
  Eigen::Vector3f position_in_world = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal_in_world = Eigen::Vector3f::Zero();  ///< unit, outwards
  std::array<std::uint8_t, 3> color_rgb{};
  float confidence = 0.0F;       ///< [0, 1]
  std::uint16_t view_count = 0;  ///< views whose depth maps agree on it

  bool operator==(const DensePoint&) const = default;
};

using DenseCloud = std::vector<DensePoint>;

}  // namespace trigmesh
