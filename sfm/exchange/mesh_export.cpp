#include "sfm/exchange/mesh_export.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

/// Twice the area of each face along its normal, summed over the faces around a vertex.
std::vector<Eigen::Vector3f> area_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3f> sums(mesh.positions.size(), Eigen::Vector3f::Zero());
  for (const std::array<std::uint32_t, 3>& face : mesh.faces) {
    const Eigen::Vector3f& a = mesh.positions[face[0]];
    const Eigen::Vector3f cross = (mesh.positions[face[1]] - a).cross(mesh.positions[face[2]] - a);
    for (const std::uint32_t corner : face) {
      sums[corner] += cross;
    }
  }
  return sums;
}

/// Unit length by way of double, so that tiny faces keep their direction; nothing for zero.
std::optional<Eigen::Vector3f> unit(const Eigen::Vector3f& vector) {
  const Eigen::Vector3d exact = vector.cast<double>();
  const double length = exact.norm();
  if (!(length > 0.0) || !std::isfinite(length)) {
    return std::nullopt;
  }
  return (exact / length).cast<float>();
}

Result<> check_page(const cv::Mat& page, std::size_t position) {
  if (page.empty() || page.dims != 2 || page.type() != CV_8UC3) {
    return fail(
        ErrorCode::kInvalidArgument, "page {} of the textured mesh is no RGB picture", position);
  }
  return {};
}

}  // namespace

Result<> ModelPlacement::validate() const {
  if (metres_per_unit && !(*metres_per_unit > 0.0 && std::isfinite(*metres_per_unit))) {
    return fail(ErrorCode::kInvalidArgument,
                "metres_per_unit is {}, must be greater than 0",
                *metres_per_unit);
  }
  return {};
}

Eigen::Vector3f ModelPlacement::point(const Eigen::Vector3f& point_in_world) const {
  const Eigen::Vector3d moved =
      metres_per_unit.value_or(1.0) * (model_from_world * point_in_world.cast<double>());
  return moved.cast<float>().array() + 0.0F;  // no negative zeros
}

Eigen::Vector3f ModelPlacement::direction(const Eigen::Vector3f& direction_in_world) const {
  return (model_from_world.rotation * direction_in_world.cast<double>()).cast<float>().array() +
         0.0F;
}

Result<> check_mesh(const TriangleMesh& mesh) {
  const std::size_t vertices = mesh.positions.size();
  if ((!mesh.normals.empty() && mesh.normals.size() != vertices) ||
      (!mesh.colors.empty() && mesh.colors.size() != vertices)) {
    return fail(ErrorCode::kInvalidArgument,
                "the mesh has {} vertices, but {} normals and {} colours",
                vertices,
                mesh.normals.size(),
                mesh.colors.size());
  }
  if (!std::ranges::all_of(mesh.positions, [](const auto& p) { return p.allFinite(); })) {
    return fail(ErrorCode::kInvalidArgument, "the mesh has a vertex that is not finite");
  }
  for (const std::array<std::uint32_t, 3>& face : mesh.faces) {
    if (std::ranges::max(face) >= vertices) {
      return fail(ErrorCode::kInvalidArgument, "the mesh has a face of vertices that do not exist");
    }
  }
  if (std::ranges::none_of(mesh.faces, has_extent)) {
    return fail(ErrorCode::kInvalidArgument, "the mesh has no face");
  }
  return {};
}

Result<> check_mesh(const TexturedMesh& textured) {
  TM_RETURN_IF_ERROR(check_mesh(textured.mesh));
  const std::size_t faces = textured.mesh.faces.size();
  if (textured.face_page.size() != faces || textured.face_uv.size() != faces) {
    return fail(ErrorCode::kInvalidArgument,
                "the textured mesh has {} faces, but {} pages and {} coordinates for them",
                faces,
                textured.face_page.size(),
                textured.face_uv.size());
  }
  for (std::size_t i = 0; i < textured.pages.size(); ++i) {
    TM_RETURN_IF_ERROR(check_page(textured.pages[i], i));
  }
  for (std::size_t i = 0; i < faces; ++i) {
    if (textured.face_page[i] >= textured.pages.size() ||
        !std::ranges::all_of(textured.face_uv[i], [](const auto& uv) { return uv.allFinite(); })) {
      return fail(ErrorCode::kInvalidArgument, "face {} of the textured mesh has no texture", i);
    }
  }
  return {};
}

std::vector<Eigen::Vector3f> unit_normals(const TriangleMesh& mesh) {
  const std::vector<Eigen::Vector3f> around = area_normals(mesh);
  std::vector<Eigen::Vector3f> normals(around.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    std::optional<Eigen::Vector3f> normal;
    if (!mesh.normals.empty()) {
      normal = unit(mesh.normals[i]);
    }
    if (!normal) {
      normal = unit(around[i]);
    }
    normals[i] = normal.value_or(-Eigen::Vector3f::UnitY());
  }
  return normals;
}

Result<std::vector<std::uint8_t>> encode_page(const cv::Mat& page, const PageEncoding& encoding) {
  return encoding.format == ImageFormat::kPng ? encode_png(page)
                                              : encode_jpeg(page, encoding.jpeg_quality);
}

std::string_view mime_type(ImageFormat format) {
  return format == ImageFormat::kPng ? "image/png" : "image/jpeg";
}

}  // namespace trigmesh
