#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "sfm/geometry/rigid3.hpp"
#include "sfm/surface/triangle_mesh.hpp"
#include "sfm/texture/textured_mesh.hpp"

// What GLB and OBJ share: where the model is put, how its pages are stored, what a mesh must be.

namespace trigmesh {

/// Half a turn about x: (x, y, z) becomes (x, -y, -z). The first camera looks along +z of the world
/// with y down; viewers look along -z with Y up.
[[nodiscard]] inline Rigid3 y_up_from_world() {
  return {.rotation = Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0)};
}

/// A quarter turn about x: (x, y, z) becomes (x, z, -y), for a world whose z is up.
[[nodiscard]] inline Rigid3 y_up_from_z_up() {
  constexpr double kHalfAngle = std::numbers::sqrt2 / 2.0;
  return {.rotation = Eigen::Quaterniond(kHalfAngle, -kHalfAngle, 0.0, 0.0)};
}

/// From the world of the reconstruction to the model in the file (right-handed, Y up):
/// point_in_model = metres_per_unit * (model_from_world * point_in_world).
struct ModelPlacement {
  Rigid3 model_from_world = y_up_from_world();
  std::optional<double> metres_per_unit;  ///< > 0; or not known: lengths stay in scene units

  [[nodiscard]] Result<> validate() const;
  [[nodiscard]] Eigen::Vector3f point(const Eigen::Vector3f& point_in_world) const;
  [[nodiscard]] Eigen::Vector3f direction(const Eigen::Vector3f& direction_in_world) const;
};

/// How pages of texture are stored.
struct PageEncoding {
  ImageFormat format = ImageFormat::kJpeg;
  int jpeg_quality = 90;  ///< [1, 100]
};

/// kInvalidArgument: no face, a corner that does not exist, a position that is not finite, lists of
/// other lengths than the mesh.
[[nodiscard]] Result<> check_mesh(const TriangleMesh& mesh);
/// The same, and pages, their numbers and coordinates.
[[nodiscard]] Result<> check_mesh(const TexturedMesh& textured);

/// Whether a face has an extent: three different corners. Others are left out of every file.
[[nodiscard]] inline bool has_extent(const std::array<std::uint32_t, 3>& face) {
  return face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
}

/// Unit normals per vertex, in the world: those of the mesh, or where it has none (or zeros) the
/// mean of the faces around, weighted by area; -y where there is none either.
[[nodiscard]] std::vector<Eigen::Vector3f> unit_normals(const TriangleMesh& mesh);

[[nodiscard]] Result<std::vector<std::uint8_t>> encode_page(const cv::Mat& page,
                                                            const PageEncoding& encoding);

/// "image/jpeg", "image/png".
[[nodiscard]] std::string_view mime_type(ImageFormat format);

}  // namespace trigmesh
