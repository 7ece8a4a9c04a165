#include "sfm/texture/texture_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/texture/atlas_pictures.hpp"
#include "sfm/texture/charts.hpp"
#include "sfm/texture/color_outliers.hpp"
#include "sfm/texture/face_splitting.hpp"
#include "sfm/texture/mesh_topology.hpp"
#include "sfm/texture/seam_leveling.hpp"
#include "sfm/texture/view_gains.hpp"
#include "sfm/texture/view_labeling.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kSmallChartFaces = 6;
constexpr int kMostSplits = 8;  // a face of 1000 px ends at 4 px
// Fewer faces than one in so many are not worth another look from all views.
constexpr std::size_t kSplitShare = 10'000;

Result<> check_range(const char* name, int value, int low, int high) {
  if (value < low || value > high) {
    return fail(
        ErrorCode::kInvalidArgument, "{} is {}, must be in [{}, {}]", name, value, low, high);
  }
  return {};
}

Result<> check_input(const TriangleMesh& mesh, std::span<const DenseView> views) {
  if (mesh.faces.empty() || views.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "cannot texture a mesh of {} faces with {} views",
                mesh.faces.size(),
                views.size());
  }
  for (const auto& face : mesh.faces) {
    if (std::any_of(face.begin(), face.end(), [&](std::uint32_t vertex) {
          return vertex >= mesh.positions.size();
        })) {
      return fail(ErrorCode::kInvalidArgument,
                  "cannot texture: a face names a vertex beyond the {} that there are",
                  mesh.positions.size());
    }
  }
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.positions.size()) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot texture: {} vertices have {} colours",
                mesh.positions.size(),
                mesh.colors.size());
  }
  for (const DenseView& view : views) {
    TM_RETURN_IF_ERROR(view.camera.validate());
    if (view.camera.model != CameraModel::kPinhole) {
      return fail(ErrorCode::kInvalidArgument,
                  "cannot texture from {}: its camera is {}, not pinhole",
                  view.name,
                  to_string(view.camera.model));
    }
  }
  return {};
}

/// A surface whose faces are small enough to be seen whole, and who sees them.
struct SeenSurface {
  TriangleMesh mesh;
  FaceViews seen;
};

Result<SeenSurface> look_at_surface(const TriangleMesh& mesh,
                                    std::span<const DenseView> views,
                                    const ViewImageSource& images,
                                    const VisibilityOptions& options,
                                    Executor& executor) {
  SeenSurface surface{.mesh = mesh, .seen = {}};
  for (int splits = 0;; ++splits) {
    TM_ASSIGN_OR_RETURN(surface.seen,
                        find_face_views(surface.mesh, views, images, options, executor));
    const std::vector<std::uint32_t>& wanted = surface.seen.worth_splitting;
    if (splits == kMostSplits || wanted.empty() ||
        wanted.size() * kSplitShare < surface.mesh.faces.size()) {
      return surface;
    }
    surface.mesh = split_faces(surface.mesh, wanted);
  }
}

/// One view a face with few seams; kNoLabel where no view sees it.
std::vector<std::uint32_t> choose_views(const FaceViews& faces,
                                        const FaceNeighbors& neighbors,
                                        std::size_t view_count,
                                        const TextureOptions& options,
                                        Executor& executor) {
  const LabelingProblem problem =
      make_labeling_problem(faces,
                            neighbors,
                            static_cast<std::uint32_t>(view_count),
                            options.seam_cost,
                            static_cast<std::size_t>(options.max_candidates));
  executor.stop_point();
  std::vector<std::uint32_t> labels = label_faces(problem, options.labeling_sweeps);
  executor.stop_point();
  absorb_small_charts(faces, neighbors, kSmallChartFaces, labels);
  return labels;
}

/// Median over the textured faces of world length a texel.
double median_texel_size(const TriangleMesh& mesh, const AtlasLayout& layout) {
  std::vector<double> sizes;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (layout.charts[layout.face_chart[f]].view == kNoLabel) {
      continue;
    }
    const auto& v = mesh.faces[f];
    const Eigen::Vector3f a = mesh.positions[v[1]] - mesh.positions[v[0]];
    const Eigen::Vector3f b = mesh.positions[v[2]] - mesh.positions[v[0]];
    const Eigen::Vector2f s = layout.face_texels[f][1] - layout.face_texels[f][0];
    const Eigen::Vector2f t = layout.face_texels[f][2] - layout.face_texels[f][0];
    const float texels = std::abs(s.x() * t.y() - s.y() * t.x());
    if (texels > 0.0F) {
      sizes.push_back(std::sqrt(static_cast<double>(a.cross(b).norm() / texels)));
    }
  }
  if (sizes.empty()) {
    return 0.0;
  }
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle;
}

void report_gains(const std::vector<ColorGain>& gains, TextureReport& report) {
  for (const ColorGain& gain : gains) {
    for (const float factor : gain) {
      report.smallest_gain = std::min(report.smallest_gain, static_cast<double>(factor));
      report.largest_gain = std::max(report.largest_gain, static_cast<double>(factor));
    }
  }
}

void report_layout(const TriangleMesh& mesh,
                   const AtlasLayout& layout,
                   const AtlasOptions& options,
                   TextureReport& report) {
  std::vector<std::uint8_t> used(report.view_count, 0);
  double rectangles = 0.0;
  for (const Chart& chart : layout.charts) {
    rectangles += static_cast<double>(chart.width) * chart.height;
    if (chart.view != kNoLabel) {
      used[chart.view] = 1;
      ++report.chart_count;
      report.textured_face_count += chart.faces.size();
    }
  }
  report.used_view_count = static_cast<std::size_t>(std::count(used.begin(), used.end(), 1));
  report.page_count = layout.page_count;
  report.page_size_px = layout.page_size_px;
  report.atlas_fill_ratio = rectangles / (static_cast<double>(layout.page_size_px) *
                                          layout.page_size_px * layout.page_count);
  report.texels_per_pixel = layout.texels_per_pixel;
  report.texel_size = median_texel_size(mesh, layout);
  if (layout.texels_per_pixel < options.texels_per_pixel) {
    report.lowered_quality.push_back(
        fmt::format("texture density lowered from {:.2f} to {:.2f} of the pictures' resolution to "
                    "fit {} page(s) of {} px",
                    options.texels_per_pixel,
                    layout.texels_per_pixel,
                    options.max_pages,
                    options.page_size_px));
  }
}

TexturedMesh assemble(const TriangleMesh& mesh,
                      const AtlasLayout& layout,
                      std::vector<cv::Mat> pages) {
  TexturedMesh textured{.mesh = mesh, .pages = std::move(pages), .face_page = {}, .face_uv = {}};
  textured.face_page.reserve(mesh.faces.size());
  textured.face_uv.reserve(mesh.faces.size());
  const auto side = static_cast<float>(layout.page_size_px);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    textured.face_page.push_back(layout.charts[layout.face_chart[f]].page);
    auto& uv = textured.face_uv.emplace_back(layout.face_texels[f]);
    for (Eigen::Vector2f& corner : uv) {
      corner = (corner.array() + 0.5F) / side;
    }
  }
  return textured;
}

}  // namespace

Result<> TextureOptions::validate() const {
  TM_RETURN_IF_ERROR(visibility.validate());
  TM_RETURN_IF_ERROR(atlas.validate());
  TM_RETURN_IF_ERROR(check_range("seam_cost", seam_cost, 0, 100'000));
  TM_RETURN_IF_ERROR(check_range("max_candidates", max_candidates, 1, 64));
  return check_range("labeling_sweeps", labeling_sweeps, 1, 20);
}

Result<TextureResult> texture_surface(const TriangleMesh& given_mesh,
                                      std::span<const DenseView> views,
                                      const ViewImageSource& images,
                                      const TextureOptions& options,
                                      Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  TM_RETURN_IF_ERROR(check_input(given_mesh, views));
  TM_ASSIGN_OR_RETURN(SeenSurface surface,
                      look_at_surface(given_mesh, views, images, options.visibility, executor));
  const TriangleMesh& mesh = surface.mesh;
  TextureResult result;
  result.report.face_count = mesh.faces.size();
  result.report.added_face_count = mesh.faces.size() - given_mesh.faces.size();
  result.report.view_count = views.size();

  const std::vector<ColorGain> gains = estimate_view_gains(surface.seen, views.size());
  report_gains(gains, result.report);
  const FaceNeighbors neighbors = face_neighbors(mesh);
  OutlierRejection agreed = reject_color_outliers(surface.seen, neighbors, gains, executor);
  surface.seen = {};
  result.report.rejected_look_count = agreed.rejected_count;

  const std::vector<std::uint32_t> labels =
      choose_views(agreed.faces, neighbors, views.size(), options, executor);
  executor.stop_point();

  TM_ASSIGN_OR_RETURN(
      AtlasLayout layout,
      lay_out_atlas(mesh, views, labels, connected_charts(labels, neighbors), options.atlas));
  report_layout(mesh, layout, options.atlas, result.report);
  TM_ASSIGN_OR_RETURN(std::vector<cv::Mat> pages, copy_pictures(layout, views, images, executor));
  executor.stop_point();
  const SeamLeveling leveling = level_seams(mesh, neighbors, layout, gains, pages);
  result.report.seam_step_before = leveling.step_before;
  result.report.seam_step_after_gains = leveling.step_after_gains;
  result.report.seam_step_after = leveling.step_after;
  finish_charts(layout, gains, leveling.offsets, options.atlas.padding_px, pages, executor);
  executor.stop_point();
  paint_patches(mesh, layout, pages);
  executor.stop_point();
  result.textured = assemble(mesh, layout, std::move(pages));
  return result;
}

}  // namespace trigmesh
