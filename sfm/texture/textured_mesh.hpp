#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// A surface with pictures on it. Plain data.
struct TexturedMesh {
  TriangleMesh mesh;
  std::vector<cv::Mat> pages;            ///< CV_8UC3 red, green, blue; all square, of one size
  std::vector<std::uint16_t> face_page;  ///< per face: position in `pages`
  std::vector<std::array<Eigen::Vector2f, 3>>
      face_uv;  ///< per face corner, [0, 1]; (0, 0) is the upper left
                ///< corner of the upper left texel
};

}  // namespace trigmesh
