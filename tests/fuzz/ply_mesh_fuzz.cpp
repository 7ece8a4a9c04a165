#include <cstddef>
#include <cstdint>

#include "firmware/base/check.hpp"
#include "sfm/exchange/ply.hpp"
#include "tests/fuzz/pieces.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Whatever is accepted has finite vertices, corners that exist, and survives being written and
/// read again.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto mesh = trigmesh::read_mesh_ply(trigmesh::fuzz::as_text(data, size));
  if (!mesh) {
    return 0;
  }
  for (const Eigen::Vector3f& position : mesh->positions) {
    TM_CHECK(position.allFinite());
  }
  for (const auto& face : mesh->faces) {
    for (const std::uint32_t corner : face) {
      TM_CHECK(corner < mesh->positions.size());
    }
  }
  const auto again = trigmesh::read_mesh_ply(trigmesh::write_mesh_ply(*mesh));
  TM_CHECK(again && again->positions == mesh->positions && again->normals == mesh->normals &&
           again->colors == mesh->colors && again->faces == mesh->faces);
  return 0;
}
