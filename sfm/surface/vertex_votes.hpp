#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "firmware/base/executor.hpp"
#include "sfm/surface/depth_frame.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// What the views say about the vertices of a mesh: their colour, and how many agree that a surface
/// is there. Add all views in order, then ask.
class VertexVotes {
 public:
  explicit VertexVotes(std::size_t vertex_count);

  /// A view agrees with a vertex when the plane of its pixel passes within `tolerance` (scene
  /// units) and the vertex faces it. `rgb` is empty or CV_8UC3 of any size of the same field of
  /// view, `mask` empty or CV_8UC1 of the size of `rgb`: where it is 0 the view gives no colour.
  void add_view(const DepthFrame& frame,
                const ViewImage& image,
                const TriangleMesh& mesh,
                float tolerance,
                Executor& executor);

  /// Views that agree, per vertex.
  [[nodiscard]] const std::vector<std::uint16_t>& support() const { return support_; }

  /// Weighted means; grey where no view gave a colour.
  [[nodiscard]] std::vector<std::array<std::uint8_t, 3>> colors() const;

 private:
  std::vector<std::uint16_t> support_;
  std::vector<Eigen::Vector4f> color_sums_;  ///< weighted red, green, blue; weight
};

}  // namespace trigmesh
