#include "sfm/surface/mesh_simplification.hpp"

#include <utility>
#include <vector>

#include <meshoptimizer.h>

#include "sfm/surface/mesh_fitting.hpp"
#include "sfm/surface/mesh_repair.hpp"

namespace trigmesh {

namespace {

// Of the extent of the mesh; the budget decides, not the error.
constexpr float kMaxErrorRatio = 0.05F;

}  // namespace

double simplify(std::size_t max_faces, TriangleMesh& mesh) {
  if (mesh.faces.size() <= max_faces) {
    return 0.0;
  }
  std::vector<std::uint32_t> indices;
  indices.reserve(3 * mesh.faces.size());
  for (const auto& face : mesh.faces) {
    indices.insert(indices.end(), face.begin(), face.end());
  }
  const float* positions = mesh.positions.front().data();
  const float extent =
      meshopt_simplifyScale(positions, mesh.positions.size(), sizeof(Eigen::Vector3f));
  float error = 0.0F;
  const std::size_t count = meshopt_simplify(indices.data(),
                                             indices.data(),
                                             indices.size(),
                                             positions,
                                             mesh.positions.size(),
                                             sizeof(Eigen::Vector3f),
                                             3 * max_faces,
                                             kMaxErrorRatio,
                                             0,
                                             &error);
  const std::vector<std::array<std::uint32_t, 3>> fine_faces = std::move(mesh.faces);
  mesh.faces.resize(count / 3);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    mesh.faces[f] = {indices[3 * f], indices[3 * f + 1], indices[3 * f + 2]};
  }
  fit_to_fine_surface(fine_faces, mesh);
  // Collapses fold thin parts together; meshoptimizer does not look for that.
  make_two_manifold(mesh);
  return static_cast<double>(error) * static_cast<double>(extent);
}

}  // namespace trigmesh
