#include "sfm/surface/surface.hpp"

#include <algorithm>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/surface/depth_frame.hpp"
#include "sfm/surface/depth_fusion.hpp"
#include "sfm/surface/hole_filling.hpp"
#include "sfm/surface/mesh_cleaning.hpp"
#include "sfm/surface/mesh_flipping.hpp"
#include "sfm/surface/mesh_repair.hpp"
#include "sfm/surface/mesh_simplification.hpp"
#include "sfm/surface/mesh_topology.hpp"
#include "sfm/surface/vertex_votes.hpp"

namespace trigmesh {

namespace {

// A depth map agrees with the surface within this many voxels.
constexpr double kSupportVoxels = 1.5;
// Neighbouring vertices are about one voxel apart: what stands out by this much is no surface.
constexpr double kSpikeVoxels = 0.9;
constexpr int kBorderPasses = 10;

/// What the views say about a mesh: support and colour of its vertices.
Result<VertexVotes> ask_views(const SurfaceInput& input,
                              const SurfaceOptions& options,
                              double voxel_size,
                              const TriangleMesh& mesh,
                              Executor& executor) {
  VertexVotes votes(mesh.positions.size());
  for (std::size_t view = 0; view < input.views.size(); ++view) {
    TM_ASSIGN_OR_RETURN(const DepthMap map, input.depth_maps->load(view));
    TM_ASSIGN_OR_RETURN(const DepthFrame frame,
                        make_depth_frame(map,
                                         input.views[view].cam_from_world,
                                         {.voxel_size = static_cast<float>(voxel_size),
                                          .max_footprint_voxels =
                                              static_cast<float>(options.max_footprint_voxels)}));
    if (frame.planes.empty()) {
      continue;
    }
    TM_ASSIGN_OR_RETURN(const ViewImage image, input.images->load(view));
    votes.add_view(frame, image, mesh, static_cast<float>(kSupportVoxels * voxel_size), executor);
  }
  return votes;
}

/// Colours the vertices and returns how many views agree with each. The normals of the distance
/// function have served then, and go: memory is scarcest while the whole mesh is cleaned.
Result<std::vector<std::uint16_t>> color_and_count(const SurfaceInput& input,
                                                   const SurfaceOptions& options,
                                                   double voxel_size,
                                                   TriangleMesh& mesh,
                                                   Executor& executor) {
  TM_ASSIGN_OR_RETURN(const VertexVotes votes,
                      ask_views(input, options, voxel_size, mesh, executor));
  mesh.colors = votes.colors();
  mesh.normals = {};
  return votes.support();
}

void clean(const SurfaceOptions& options,
           const std::vector<std::uint16_t>& support,
           TriangleMesh& mesh,
           SurfaceReport& report,
           Executor& executor) {
  const auto voxel = static_cast<float>(report.voxel_size);
  report.unsupported_faces = remove_unsupported(support, options.min_support_views, mesh);
  const RemovedComponents removed = remove_small_components(options.min_component_area_ratio, mesh);
  report.removed_components = removed.components;
  report.removed_component_faces = removed.faces;
  executor.stop_point();
  flatten_spikes(static_cast<float>(kSpikeVoxels) * voxel, mesh);
  executor.stop_point();
  smooth(options.smoothing_passes, mesh);
  executor.stop_point();
  FilledHoles holes =
      fill_holes(static_cast<float>(options.max_filled_hole_voxels) * voxel, voxel, mesh);
  report.filled_holes = holes.filled_count;
  report.open_hole_count = holes.open.size();
  if (holes.open.size() > kMaxReportedHoles) {
    holes.open.resize(kMaxReportedHoles);
  }
  report.open_holes = std::move(holes.open);
}

}  // namespace

Result<SurfaceResult> make_surface(const SurfaceInput& input,
                                   const SurfaceOptions& options,
                                   Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  SurfaceReport report;
  TM_ASSIGN_OR_RETURN(TriangleMesh mesh,
                      fuse_depth_maps(input.views, *input.depth_maps, options, report, executor));
  report.extracted_faces = mesh.faces.size();
  TM_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> support,
                      color_and_count(input, options, report.voxel_size, mesh, executor));
  clean(options, support, mesh, report, executor);
  if (mesh.faces.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "cannot make a surface: nothing is left of {} faces that {} views gave",
                report.extracted_faces,
                report.view_count);
  }
  executor.stop_point();
  make_two_manifold(mesh);
  executor.stop_point();
  smooth_borders(kBorderPasses, mesh);
  executor.stop_point();
  report.faces_before_simplification = mesh.faces.size();
  report.simplification_error = simplify(options.max_faces, mesh);
  executor.stop_point();
  flip_slivers(mesh);
  executor.stop_point();
  mesh.normals = vertex_normals(mesh);
  report.non_manifold_edges = analyze_topology(mesh).non_manifold_edges;
  return SurfaceResult{std::move(mesh), std::move(report)};
}

}  // namespace trigmesh
