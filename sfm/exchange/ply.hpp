#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

struct ColoredPoint {
  Eigen::Vector3f position_in_world = Eigen::Vector3f::Zero();
  std::array<std::uint8_t, 3> color_rgb{};

  bool operator==(const ColoredPoint&) const = default;
};

/// The landmarks of a scene, in their order.
[[nodiscard]] std::vector<ColoredPoint> colored_points(const Scene& scene);

/// A binary little endian PLY: float x y z, uchar red green blue.
[[nodiscard]] std::string write_ply(std::span<const ColoredPoint> points);

/// The vertices of an ASCII or binary little endian PLY. Properties may have any type and order;
/// what is not x y z red green blue is skipped, lists too, and so are other elements. Without
/// colours (of an 8-bit type) points are white. kUnsupported for big endian, kCorruptData for what
/// is no PLY; memory is bounded by a multiple of the file.
[[nodiscard]] Result<std::vector<ColoredPoint>> read_ply(std::string_view bytes);

}  // namespace trigmesh
