#include "sfm/surface/preview_surface.hpp"

#include <vector>

#include "sfm/surface/sparse_depth.hpp"
#include "sfm/surface/surface.hpp"

namespace trigmesh {

namespace {

constexpr int kMapWidthPx = 160;

class SparseMaps final : public DepthMapSource {
 public:
  explicit SparseMaps(const std::vector<SparseDepth>& sparse) : sparse_(sparse) {}

  [[nodiscard]] Result<DepthMap> load(std::size_t view) const override { return sparse_[view].map; }

 private:
  const std::vector<SparseDepth>& sparse_;  // outlives this
};

class SparseImages final : public ViewImageSource {
 public:
  explicit SparseImages(const std::vector<SparseDepth>& sparse) : sparse_(sparse) {}

  [[nodiscard]] Result<ViewImage> load(std::size_t view) const override {
    return sparse_[view].image;
  }

 private:
  const std::vector<SparseDepth>& sparse_;  // outlives this
};

/// Interpolated depths are off by more than a voxel where the surface is not flat: a wide band, and
/// only a weak say about free space.
SurfaceOptions preview_options() {
  SurfaceOptions options;
  options.voxel_footprint_ratio = 1.2;
  options.truncation_voxels = 4.0;
  options.free_space_weight_ratio = 0.1;
  options.min_voxel_weight = 0.05;
  options.min_support_views = 1;
  options.min_component_area_ratio = 0.005;
  options.max_filled_hole_voxels = 15.0;
  options.smoothing_passes = 3;
  options.max_faces = 100'000;
  options.max_memory_bytes = std::size_t{200} << 20U;
  return options;
}

}  // namespace

Result<SurfaceResult> make_preview_surface(const Scene& scene, Executor& executor) {
  std::vector<DenseView> views;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].cam_from_world) {
      views.push_back({scene.views[v].name, {}, *scene.views[v].cam_from_world, id_of<ViewId>(v)});
    }
  }
  std::vector<SparseDepth> sparse(views.size());
  executor.for_each_index(views.size(), [&](std::size_t v) {
    sparse[v] = interpolate_landmarks(scene, views[v].source, kMapWidthPx);
    views[v].camera = sparse[v].map.camera;
  });
  const SparseMaps maps(sparse);
  const SparseImages images(sparse);
  return make_surface({views, &maps, &images}, preview_options(), executor);
}

}  // namespace trigmesh
