#include <benchmark/benchmark.h>

#include "sfm/texture/mesh_projection.hpp"
#include "sfm/texture/mesh_topology.hpp"
#include "sfm/texture/texture_surface.hpp"
#include "sfm/texture/textured_render.hpp"
#include "tests/unit/sfm/texture/painted_scene.hpp"

namespace trigmesh {
namespace {

/// A painted square of 2 * cells^2 faces under `views` small views.
void texture_square(benchmark::State& state) {
  const TriangleMesh mesh = square_mesh(0.7, static_cast<int>(state.range(0)), 0.0);
  PaintedScene scene;
  add_ring(scene, static_cast<int>(state.range(1)));
  SerialExecutor executor;
  for (auto _ : state) {
    benchmark::DoNotOptimize(texture_surface(mesh, scene.views, scene.images, {}, executor));
  }
  state.SetItemsProcessed(state.iterations() * std::ssize(mesh.faces));
}

BENCHMARK(texture_square)
    ->Args({50, 8})
    ->Args({150, 8})
    ->Args({150, 32})
    ->Unit(benchmark::kMillisecond);

void depth_raster(benchmark::State& state) {
  const TriangleMesh mesh = square_mesh(0.7, static_cast<int>(state.range(0)), 0.0);
  const Rigid3 cam_from_world = looking_at({0.3, 0.2, 2.0}, Eigen::Vector3d::Zero());
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        render_inverse_depth(mesh, project_mesh(mesh, small_camera(), cam_from_world), {120, 90}));
  }
  state.SetItemsProcessed(state.iterations() * std::ssize(mesh.faces));
}

BENCHMARK(depth_raster)->Arg(50)->Arg(300)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trigmesh
