// Steps of the surface on a sphere: extraction from the distance function, simplification.

#include <algorithm>

#include <benchmark/benchmark.h>

#include "sfm/surface/marching_cubes.hpp"
#include "sfm/surface/mesh_simplification.hpp"

namespace {

constexpr int kBlocks = 8;

trigmesh::VoxelGrid sphere_grid() {
  std::vector<trigmesh::BlockKey> keys;
  for (int z = -kBlocks; z < kBlocks; ++z) {
    for (int y = -kBlocks; y < kBlocks; ++y) {
      for (int x = -kBlocks; x < kBlocks; ++x) {
        keys.push_back(*trigmesh::block_key({x, y, z}));
      }
    }
  }
  trigmesh::VoxelGrid grid(1.0, keys);
  for (std::size_t b = 0; b < grid.size(); ++b) {
    const Eigen::Vector3i corner = 8 * trigmesh::block_position(grid.key(b));
    for (int v = 0; v < 512; ++v) {
      const Eigen::Vector3i at = corner + Eigen::Vector3i(v % 8, v / 8 % 8, v / 64);
      const auto i = static_cast<std::size_t>(v);
      grid.block(b).distance[i] = std::clamp((at.cast<float>().norm() - 60.3F) / 3.0F, -1.0F, 1.0F);
      grid.block(b).weight[i] = 1.0F;
    }
  }
  return grid;
}

void extract(benchmark::State& state) {
  const trigmesh::VoxelGrid grid = sphere_grid();
  trigmesh::SerialExecutor serial;
  for (auto _ : state) {
    benchmark::DoNotOptimize(trigmesh::extract_surface(grid, 0.5F, serial));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(grid.size()));
}

void simplify_to_tenth(benchmark::State& state) {
  trigmesh::SerialExecutor serial;
  const trigmesh::TriangleMesh full = trigmesh::extract_surface(sphere_grid(), 0.5F, serial);
  for (auto _ : state) {
    trigmesh::TriangleMesh mesh = full;
    benchmark::DoNotOptimize(trigmesh::simplify(full.faces.size() / 10, mesh));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(full.faces.size()));
}

BENCHMARK(extract)->Unit(benchmark::kMillisecond);
BENCHMARK(simplify_to_tenth)->Unit(benchmark::kMillisecond);

}  // namespace
