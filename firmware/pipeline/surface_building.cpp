#include "firmware/pipeline/surface_building.hpp"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "firmware/base/binary_stream.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/pipeline/dense_stage.hpp"
#include "firmware/pipeline/finish.hpp"
#include "firmware/pipeline/model_writer.hpp"
#include "firmware/pipeline/moving_stage.hpp"
#include "firmware/pipeline/photo_images.hpp"
#include "firmware/pipeline/surface_plan.hpp"
#include "sfm/coverage/surface_coverage.hpp"
#include "sfm/dense/undistortion.hpp"
#include "sfm/exchange/glb.hpp"
#include "sfm/exchange/obj.hpp"
#include "sfm/exchange/ply.hpp"
#include "sfm/surface/mesh_topology.hpp"
#include "sfm/surface/preview_surface.hpp"
#include "sfm/surface/surface.hpp"

namespace trigmesh {

namespace {

constexpr std::size_t kMaxCloudBytes = std::size_t{8} << 30U;

/// Everything that the steps share.
struct Work {
  const BuildInput& input;
  const StageContext& context;
  Stopwatch& stopwatch;
  ReconstructionReport& report;
  const Scene& scene;
  std::vector<DenseView> views;
  PhotoImages images;
  SurfacePlan plan;
  std::vector<DepthPicture> pictures{};  ///< for the page
  std::string glb{};                     ///< likewise
  PhotoSet masked_photos{};              ///< what moved is left out; set when something did
  std::optional<PhotoImages> masked_images{};

  /// The photographs as the stages after the depth maps use them.
  [[nodiscard]] const PhotoImages& photographs() const {
    return masked_images ? *masked_images : images;
  }
};

void warn(ReconstructionReport& report, const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) {
    report.notes.push_back({NoteSeverity::kWarning, sentence});
  }
}

Result<> check_not_stopped(const StageContext& context, const char* what) {
  if (context.stop.stop_requested()) {
    return fail(ErrorCode::kCancelled, "stopped before {}; finished stages are kept", what);
  }
  return {};
}

Result<> publish(const Work& work,
                 const std::vector<NamedFile>& files,
                 std::string_view renewed_folder = {}) {
  return extend_model(
      work.input.place,
      files,
      work.input.components,
      work.report,
      {.glb = work.glb, .glb_name = "textured.glb", .depth_pictures = work.pictures},
      renewed_folder);
}

/// What the checkpoint of the cloud holds: a hash of its file.
std::vector<std::uint8_t> seal_of(std::string_view ply) {
  BinaryWriter seal;
  seal.value(content_hash(ply));
  return seal.take();
}

/// The cloud of a former run in the model, when its file is the one that was made of these maps.
std::optional<DenseCloud> stored_cloud(const Work& work, const DepthMaps& depth) {
  const auto told = work.context.checkpoints.load("dense", depth.key);
  if (!told) {
    return std::nullopt;
  }
  const auto ply = read_file(work.input.place.model() / "dense.ply", kMaxCloudBytes);
  if (!ply || seal_of(*ply) != *told) {
    return std::nullopt;
  }
  auto points = read_dense_ply(*ply);
  return points ? std::optional(std::move(*points)) : std::nullopt;
}

Result<> picture_depth(Work& work, const DepthMaps& depth) {
  const std::size_t count = std::min(work.views.size(), kReportDepthViewLimit);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t view = k * work.views.size() / count;
    TM_ASSIGN_OR_RETURN(const DepthMap map, depth.maps.load(view));
    if (map.depth.empty()) {
      continue;
    }
    TM_ASSIGN_OR_RETURN(const ViewImage image, work.images.load(view));
    TM_ASSIGN_OR_RETURN(DepthPicture picture,
                        make_depth_picture(work.views[view].name, image.rgb, map));
    work.pictures.push_back(std::move(picture));
  }
  return {};
}

Result<DenseSection> sum_up(const Work& work, const DepthMaps& depth, const DenseCloud& cloud) {
  DenseSection section;
  double filled = 0.0;
  for (std::size_t view = 0; view < work.views.size(); ++view) {
    TM_ASSIGN_OR_RETURN(const DepthMap map, depth.maps.load(view));
    if (map.depth.empty()) {
      continue;
    }
    ++section.views;
    section.map_width_px = std::max(section.map_width_px, map.depth.cols);
    section.map_height_px = std::max(section.map_height_px, map.depth.rows);
    filled += static_cast<double>(cv::countNonZero(map.confidence)) /
              static_cast<double>(map.confidence.total());
  }
  section.filled_ratio = section.views > 0 ? filled / static_cast<double>(section.views) : 0.0;
  section.points = cloud.size();
  for (const DensePoint& point : cloud) {
    section.mean_view_count += point.view_count;
  }
  section.mean_view_count /= std::max<double>(1.0, static_cast<double>(cloud.size()));
  return section;
}

/// Adds the cloud and what is known of it to the model; the cloud is freed on the way.
Result<> densify(Work& work, const DenseInput& input, const DepthMaps& depth) {
  TM_RETURN_IF_ERROR(check_not_stopped(work.context, "the dense cloud"));
  TM_RETURN_IF_ERROR(picture_depth(work, depth));
  if (const auto stored = stored_cloud(work, depth)) {
    TM_ASSIGN_OR_RETURN(work.report.dense, sum_up(work, depth, *stored));
    work.stopwatch.finish(Stage::kFuse);
    return publish(work, {});
  }
  TM_ASSIGN_OR_RETURN(DenseCloud cloud, fuse_maps(input, depth, work.context));
  TM_ASSIGN_OR_RETURN(work.report.dense, sum_up(work, depth, cloud));
  std::vector<NamedFile> files(1);
  files[0] = {"dense.ply", write_dense_ply(cloud)};
  DenseCloud().swap(cloud);
  work.stopwatch.finish(Stage::kFuse);
  TM_RETURN_IF_ERROR(publish(work, files));
  return work.context.checkpoints.save("dense", depth.key, seal_of(files[0].bytes));
}

SurfaceSection sum_up(const SurfaceResult& made) {
  SurfaceSection section;
  section.vertices = made.mesh.positions.size();
  section.faces = made.mesh.faces.size();
  const MeshComponents pieces = find_components(made.mesh);
  section.components = pieces.areas.size();
  section.area = std::accumulate(pieces.areas.begin(), pieces.areas.end(), 0.0);
  section.holes_filled = made.report.filled_holes;
  section.holes_open = made.report.open_hole_count;
  const std::size_t told = std::min<std::size_t>(made.report.open_holes.size(), 10);
  for (std::size_t i = 0; i < told; ++i) {
    const SurfaceHole& hole = made.report.open_holes[i];
    section.largest_holes.push_back(
        {hole.center_in_world.cast<double>(), static_cast<double>(hole.perimeter)});
  }
  if (made.report.memory_steps > 0) {
    section.lowered.push_back(
        fmt::format("to bound memory, the surface was made with voxels of {:.4g} instead of {:.4g}",
                    made.report.voxel_size,
                    made.report.wanted_voxel_size));
  }
  return section;
}

Result<TriangleMesh> add_mesh(Work& work, SurfaceResult made) {
  work.report.surface = sum_up(made);
  work.report.finish =
      judge_finish(measure_surface_coverage(made.mesh, work.views, work.context.executor),
                   work.views,
                   work.report.verdict);
  warn(work.report, work.report.surface->lowered);
  work.stopwatch.finish(Stage::kSurface);
  std::vector<NamedFile> files(1);
  files[0] = {"mesh.ply", write_mesh_ply(made.mesh)};
  TM_RETURN_IF_ERROR(publish(work, files));
  return std::move(made.mesh);
}

/// Surface from the sparse points alone.
Result<TriangleMesh> preview_mesh(Work& work) {
  work.context.listener.on_progress({Stage::kSurface, 0, 1});
  TM_ASSIGN_OR_RETURN(SurfaceResult made, make_preview_surface(work.scene, work.context.executor));
  work.context.listener.on_progress({Stage::kSurface, 1, 1});
  return add_mesh(work, std::move(made));
}

/// Masks of this run into the model, those of an earlier one out of it.
Result<> publish_masks(const Work& work, const std::vector<EncodedMask>& masks) {
  const std::vector<NamedFile> files = mask_files(work.views, masks);
  std::error_code error;
  if (files.empty() && !std::filesystem::exists(work.input.place.model() / "masks", error)) {
    return {};
  }
  return publish(work, files, "masks");
}

/// Looks for what moved; where it finds something, masks go into the model and into effect.
Result<DepthMaps> leave_out_moving(Work& work, DepthMaps depth) {
  if (work.plan.moving_side_px == 0) {
    TM_RETURN_IF_ERROR(publish_masks(work, std::vector<EncodedMask>(work.views.size())));
    return depth;
  }
  const DenseInput seen{work.scene, work.views, work.images, work.plan, work.input.options.seed};
  TM_ASSIGN_OR_RETURN(const auto masks, find_moving(seen, depth, work.context));
  TM_ASSIGN_OR_RETURN(work.report.moving, sum_up_masks(work.views, masks));
  TM_RETURN_IF_ERROR(publish_masks(work, masks));
  if (work.report.moving->images.empty()) {
    work.stopwatch.finish(Stage::kMoving);
    return depth;
  }
  work.masked_photos = with_masks(work.input.photos, work.views, masks);
  TM_ASSIGN_OR_RETURN(PhotoImages images,
                      PhotoImages::create(work.masked_photos, work.scene, work.views));
  work.masked_images.emplace(std::move(images));
  auto masked = filter_masked(
      {work.scene, work.views, *work.masked_images, work.plan, work.input.options.seed},
      std::move(depth),
      work.context);
  work.stopwatch.finish(Stage::kMoving);
  return masked;
}

/// Depth maps, dense cloud, and the surface when it is wanted.
Result<std::optional<TriangleMesh>> dense_mesh(Work& work) {
  const ReconstructionOptions& options = work.input.options;
  TM_ASSIGN_OR_RETURN(
      DepthMaps all_depth,
      make_depth_maps({work.scene, work.views, work.images, work.plan, options.seed},
                      work.context));
  work.stopwatch.finish(Stage::kDepth);
  TM_ASSIGN_OR_RETURN(const DepthMaps depth, leave_out_moving(work, std::move(all_depth)));
  const DenseInput input{work.scene, work.views, work.photographs(), work.plan, options.seed};
  TM_RETURN_IF_ERROR(densify(work, input, depth));
  if (options.build.last_stage == LastStage::kDense) {
    return std::optional<TriangleMesh>();
  }
  TM_RETURN_IF_ERROR(check_not_stopped(work.context, "the surface"));
  work.context.listener.on_progress({Stage::kSurface, 0, 1});
  TM_ASSIGN_OR_RETURN(SurfaceResult made,
                      make_surface({work.views, &depth.maps, &work.photographs()},
                                   work.plan.surface,
                                   work.context.executor));
  work.context.listener.on_progress({Stage::kSurface, 1, 1});
  TM_ASSIGN_OR_RETURN(TriangleMesh mesh, add_mesh(work, std::move(made)));
  return std::optional(std::move(mesh));
}

TextureSection sum_up(const TextureReport& made) {
  TextureSection section;
  section.views_used = made.used_view_count;
  section.charts = made.chart_count;
  section.pages = static_cast<std::size_t>(made.page_count);
  section.page_size_px = made.page_size_px;
  section.textured_ratio = made.face_count == 0 ? 0.0
                                                : static_cast<double>(made.textured_face_count) /
                                                      static_cast<double>(made.face_count);
  section.lowered = made.lowered_quality;
  return section;
}

/// How files for viewers are turned and scaled, by what the report tells of the world.
ModelPlacement placement_of(const ReconstructionReport& report) {
  ModelPlacement placement;
  placement.metres_per_unit = report.metres_per_unit;
  if (!report.scale.empty() && report.scale.front().z_is_up) {
    placement.model_from_world = y_up_from_z_up();
  }
  return placement;
}

Result<> add_texture(Work& work, const TriangleMesh& mesh) {
  TM_RETURN_IF_ERROR(check_not_stopped(work.context, "the texture"));
  work.context.listener.on_progress({Stage::kTexture, 0, 1});
  TM_ASSIGN_OR_RETURN(
      const TextureResult made,
      texture_surface(
          mesh, work.views, work.photographs(), work.plan.texture, work.context.executor));
  work.report.texture = sum_up(made.report);
  warn(work.report, made.report.lowered_quality);
  work.context.executor.stop_point();
  ObjOptions obj;
  obj.placement = placement_of(work.report);
  TM_ASSIGN_OR_RETURN(std::vector<NamedFile> files, write_obj(made.textured, obj));
  work.context.executor.stop_point();
  GlbOptions glb;
  glb.placement = obj.placement;
  glb.generator = fmt::format("trigmesh {}", work.input.options.software_version);
  TM_ASSIGN_OR_RETURN(work.glb, write_glb(made.textured, glb));
  files.push_back({"textured.glb", work.glb});
  work.context.listener.on_progress({Stage::kTexture, 1, 1});
  work.stopwatch.finish(Stage::kTexture);
  return publish(work, files);
}

}  // namespace

Result<> build_surface(const BuildInput& input,
                       const StageContext& context,
                       Stopwatch& stopwatch,
                       ReconstructionReport& report) {
  const BuildOptions& options = input.options.build;
  if (options.last_stage == LastStage::kSparse) {
    return {};
  }
  const Scene& scene = input.components.front();
  std::vector<DenseView> views = dense_views(scene);
  TM_ASSIGN_OR_RETURN(PhotoImages images, PhotoImages::create(input.photos, scene, views));
  TM_ASSIGN_OR_RETURN(SurfacePlan plan,
                      plan_surface(views, options, input.options.memory_limit_bytes));
  warn(report, plan.lowered);
  Work work{input,
            context,
            stopwatch,
            report,
            scene,
            std::move(views),
            std::move(images),
            std::move(plan)};
  std::optional<TriangleMesh> mesh;
  if (options.preset == QualityPreset::kPreview) {
    TM_ASSIGN_OR_RETURN(mesh, preview_mesh(work));
  } else {
    TM_ASSIGN_OR_RETURN(mesh, dense_mesh(work));
  }
  if (mesh && options.last_stage == LastStage::kTexture) {
    TM_RETURN_IF_ERROR(add_texture(work, *mesh));
  }
  return {};
}

}  // namespace trigmesh
