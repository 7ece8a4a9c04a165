// Steps of the surface on a sphere: extraction from the distance function, simplification, repair;
// and the whole way from depth maps, in one tile and in several.

#include <algorithm>
#include <cmath>
#include <vector>

#include <benchmark/benchmark.h>

#include "sfm/surface/marching_cubes.hpp"
#include "sfm/surface/mesh_repair.hpp"
#include "sfm/surface/mesh_simplification.hpp"
#include "sfm/surface/surface.hpp"

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

void repair(benchmark::State& state) {
  trigmesh::SerialExecutor serial;
  trigmesh::TriangleMesh mesh = trigmesh::extract_surface(sphere_grid(), 0.5F, serial);
  for (auto _ : state) {
    benchmark::DoNotOptimize(trigmesh::make_two_manifold(mesh));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.faces.size()));
}

constexpr int kSide = 320;
constexpr double kFocal = 360.0;
constexpr int kViews = 12;

/// Cameras on a circle of radius 2 around a sphere of radius 0.5.
std::vector<trigmesh::DenseView> circle_of_views() {
  std::vector<trigmesh::DenseView> views(kViews);
  for (int v = 0; v < kViews; ++v) {
    const double turn = 2.0 * 3.141592653589793 * v / kViews;
    views[static_cast<std::size_t>(v)].camera = {.model = trigmesh::CameraModel::kPinhole,
                                                 .width_px = kSide,
                                                 .height_px = kSide,
                                                 .fx_px = kFocal,
                                                 .fy_px = kFocal,
                                                 .cx_px = 0.5 * (kSide - 1),
                                                 .cy_px = 0.5 * (kSide - 1)};
    trigmesh::Rigid3& pose = views[static_cast<std::size_t>(v)].cam_from_world;
    pose.rotation = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY());
    pose.translation = {0.0, 0.0, 2.0};
  }
  return views;
}

/// Every camera sees the sphere in the same way: one map for all.
class SphereMaps final : public trigmesh::DepthMapSource {
 public:
  SphereMaps() {
    map_.camera = circle_of_views().front().camera;
    map_.depth = cv::Mat::zeros(kSide, kSide, CV_32FC1);
    map_.normal = cv::Mat::zeros(kSide, kSide, CV_32FC3);
    map_.confidence = cv::Mat::zeros(kSide, kSide, CV_8UC1);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const Eigen::Vector3d ray(
            (x - map_.camera.cx_px) / kFocal, (y - map_.camera.cy_px) / kFocal, 1.0);
        const double under = 4.0 - ray.squaredNorm() * 3.75;
        if (under > 0.0) {
          const double depth = (2.0 - std::sqrt(under)) / ray.squaredNorm();
          const Eigen::Vector3f normal =
              (2.0 * (depth * ray - Eigen::Vector3d(0.0, 0.0, 2.0))).cast<float>();
          map_.depth.at<float>(y, x) = static_cast<float>(depth);
          map_.normal.at<cv::Vec3f>(y, x) = cv::Vec3f(normal.x(), normal.y(), normal.z());
          map_.confidence.at<std::uint8_t>(y, x) = 255;
        }
      }
    }
  }

  [[nodiscard]] trigmesh::Result<trigmesh::DepthMap> load(std::size_t /*view*/) const override {
    return map_;
  }

 private:
  trigmesh::DepthMap map_;
};

class NoImages final : public trigmesh::ViewImageSource {
 public:
  [[nodiscard]] trigmesh::Result<trigmesh::ViewImage> load(std::size_t /*view*/) const override {
    return trigmesh::ViewImage{};
  }
};

void from_depth_maps(benchmark::State& state) {
  trigmesh::SerialExecutor serial;
  const std::vector<trigmesh::DenseView> views = circle_of_views();
  const SphereMaps maps;
  const NoImages images;
  trigmesh::SurfaceOptions options;
  options.max_tile_bytes = static_cast<std::size_t>(state.range(0)) << 20U;
  double tiles = 0.0;
  for (auto _ : state) {
    const auto made = trigmesh::make_surface({views, &maps, &images}, options, serial);
    if (!made) {
      state.SkipWithError(made.error().message.c_str());
      break;
    }
    tiles = static_cast<double>(made->report.tile_count);
  }
  state.counters["tiles"] = tiles;
}

BENCHMARK(extract)->Unit(benchmark::kMillisecond);
BENCHMARK(simplify_to_tenth)->Unit(benchmark::kMillisecond);
BENCHMARK(repair)->Unit(benchmark::kMillisecond);
BENCHMARK(from_depth_maps)->ArgName("tile_mb")->Arg(512)->Arg(4)->Unit(benchmark::kMillisecond);

}  // namespace
