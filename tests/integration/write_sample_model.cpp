// write_sample_model DIR: textured.glb, textured.obj with its files, mesh.glb, mesh.ply, dense.ply
// and report.html of the globe of tests/support, for open_in_viewers and for looking at.

#include <cstdio>
#include <filesystem>
#include <span>

#include "firmware/base/check.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/glb.hpp"
#include "sfm/exchange/obj.hpp"
#include "sfm/exchange/ply.hpp"
#include "tests/integration/sample_report.hpp"
#include "tests/support/textured_globe.hpp"

namespace trigmesh {
namespace {

Result<> write_all(const std::filesystem::path& folder) {
  const TexturedMesh globe = test_support::make_textured_globe();
  TriangleMesh mesh = globe.mesh;
  DenseCloud cloud;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Eigen::Vector3f color = 127.5F * (mesh.normals[i] + Eigen::Vector3f::Ones());
    mesh.colors.push_back({static_cast<std::uint8_t>(color.x()),
                           static_cast<std::uint8_t>(color.y()),
                           static_cast<std::uint8_t>(color.z())});
    cloud.push_back({mesh.positions[i], mesh.normals[i], mesh.colors[i], 0.5F, 3});
  }
  TM_RETURN_IF_ERROR(make_directory(folder));
  TM_ASSIGN_OR_RETURN(const std::string textured_glb, write_glb(globe));
  TM_RETURN_IF_ERROR(write_file_atomically(folder / "textured.glb", textured_glb));
  TM_ASSIGN_OR_RETURN(const std::string mesh_glb, write_glb(mesh));
  TM_RETURN_IF_ERROR(write_file_atomically(folder / "mesh.glb", mesh_glb));
  TM_ASSIGN_OR_RETURN(const std::vector<NamedFile> obj, write_obj(globe));
  TM_RETURN_IF_ERROR(write_files(folder, obj));
  TM_RETURN_IF_ERROR(
      write_file_atomically(folder / "report.html", test_support::sample_report_page()));
  TM_RETURN_IF_ERROR(write_file_atomically(folder / "mesh.ply", write_mesh_ply(mesh)));
  return write_file_atomically(folder / "dense.ply", write_dense_ply(cloud));
}

}  // namespace
}  // namespace trigmesh

int main(int argc, char** argv) {
  const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  if (arguments.size() != 2) {
    (void)std::fputs("usage: write_sample_model DIR\n", stderr);
    return 2;
  }
  const trigmesh::Result<> written = trigmesh::write_all(arguments[1]);
  if (!written) {
    (void)std::fprintf(stderr, "write_sample_model: %s\n", written.error().message.c_str());
    return 1;
  }
  return 0;
}
