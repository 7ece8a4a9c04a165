#include "sfm/texture/atlas_layout.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/texture/chart_merging.hpp"
#include "sfm/texture/mesh_projection.hpp"
#include "sfm/texture/rectangle_packing.hpp"

namespace trigmesh {
namespace {

constexpr double kDensityStep = 0.94;
constexpr double kLowestDensityShare = 0.05;
constexpr std::size_t kPatchesPerSheet = kPatchesPerRow * kPatchesPerRow;
constexpr int kSmallestPage = 64;

using FaceCorners = std::vector<std::array<Eigen::Vector2f, 3>>;

/// Corners of the labelled faces in their pictures, pixels.
FaceCorners picture_corners(const TriangleMesh& mesh,
                            std::span<const DenseView> views,
                            const std::vector<Chart>& charts) {
  FaceCorners corners(mesh.faces.size());
  std::vector<std::vector<std::size_t>> charts_of_view(views.size());
  for (std::size_t c = 0; c < charts.size(); ++c) {
    charts_of_view[charts[c].view].push_back(c);
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (charts_of_view[v].empty()) {
      continue;
    }
    const ProjectedMesh projected = project_mesh(mesh, views[v].camera, views[v].cam_from_world);
    for (const std::size_t c : charts_of_view[v]) {
      for (const std::uint32_t face : charts[c].faces) {
        corners[face] = project_face(mesh, projected, face).corners_px;
      }
    }
  }
  return corners;
}

/// Pixels of the full picture -> texels of the scaled one.
struct TexelMap {
  Eigen::Array2f scale;

  [[nodiscard]] Eigen::Vector2f operator()(const Eigen::Vector2f& pixel) const {
    return (pixel.array() + 0.5F) * scale - 0.5F;
  }
};

TexelMap texel_map(const Camera& camera, double texels_per_pixel) {
  const Eigen::Vector2i size = scaled_size(camera, texels_per_pixel);
  return {Eigen::Array2f(static_cast<float>(size.x()) / static_cast<float>(camera.width_px),
                         static_cast<float>(size.y()) / static_cast<float>(camera.height_px))};
}

/// The rectangle of a chart in its scaled picture, one texel wider than its faces.
void find_rectangle(const FaceCorners& corners,
                    const Camera& camera,
                    double texels_per_pixel,
                    Chart& chart) {
  const TexelMap map = texel_map(camera, texels_per_pixel);
  Eigen::Vector2f low = map(corners[chart.faces.front()][0]);
  Eigen::Vector2f high = low;
  for (const std::uint32_t face : chart.faces) {
    for (const Eigen::Vector2f& corner : corners[face]) {
      low = low.cwiseMin(map(corner));
      high = high.cwiseMax(map(corner));
    }
  }
  const Eigen::Vector2i size = scaled_size(camera, texels_per_pixel);
  chart.source_x = std::max(0, static_cast<int>(std::floor(low.x())) - 1);
  chart.source_y = std::max(0, static_cast<int>(std::floor(low.y())) - 1);
  chart.width =
      std::min(size.x() - 1, static_cast<int>(std::ceil(high.x())) + 1) - chart.source_x + 1;
  chart.height =
      std::min(size.y() - 1, static_cast<int>(std::ceil(high.y())) + 1) - chart.source_y + 1;
}

/// Faces without a label, a sheet for every kPatchesPerSheet of them.
std::vector<Chart> patch_sheets(std::span<const std::uint32_t> labels) {
  std::vector<Chart> sheets;
  for (std::size_t f = 0; f < labels.size(); ++f) {
    if (labels[f] != kNoLabel) {
      continue;
    }
    if (sheets.empty() || sheets.back().faces.size() == kPatchesPerSheet) {
      sheets.emplace_back();
    }
    sheets.back().faces.push_back(static_cast<std::uint32_t>(f));
  }
  for (Chart& sheet : sheets) {
    const std::size_t rows = (sheet.faces.size() + kPatchesPerRow - 1) / kPatchesPerRow;
    sheet.width = kPatchSide * static_cast<int>(std::min(sheet.faces.size(), kPatchesPerRow));
    sheet.height = kPatchSide * static_cast<int>(rows);
  }
  return sheets;
}

/// Packs on one page as small as possible, or on up to max_pages full ones.
std::optional<Packing> pack_charts(const std::vector<Chart>& charts,
                                   const AtlasOptions& options,
                                   int& page_size_px) {
  std::vector<RectangleSize> sizes;
  std::int64_t area = 0;
  for (const Chart& chart : charts) {
    const RectangleSize& size = sizes.emplace_back(
        RectangleSize{chart.width + 2 * options.padding_px, chart.height + 2 * options.padding_px});
    area += static_cast<std::int64_t>(size.width) * size.height;
  }
  for (int side = std::min(kSmallestPage, options.page_size_px); side <= options.page_size_px;
       side *= 2) {
    const bool full = side == options.page_size_px;
    const int pages = full ? options.max_pages : 1;
    if (area > static_cast<std::int64_t>(side) * side * pages) {
      continue;
    }
    if (auto packing = pack_rectangles(sizes, side, pages)) {
      page_size_px = side;
      return packing;
    }
  }
  return std::nullopt;
}

void place_faces(const FaceCorners& corners,
                 std::span<const DenseView> views,
                 AtlasLayout& layout) {
  for (std::size_t c = 0; c < layout.charts.size(); ++c) {
    const Chart& chart = layout.charts[c];
    const Eigen::Vector2f page_origin(static_cast<float>(chart.page_x),
                                      static_cast<float>(chart.page_y));
    for (std::size_t i = 0; i < chart.faces.size(); ++i) {
      const std::uint32_t face = chart.faces[i];
      layout.face_chart[face] = static_cast<std::uint32_t>(c);
      if (chart.view == kNoLabel) {
        const Eigen::Vector2f first = page_origin + patch_origin(i).cast<float>();
        layout.face_texels[face] = {first + Eigen::Vector2f(1.0F, 1.0F),
                                    first + Eigen::Vector2f(2.0F, 1.0F),
                                    first + Eigen::Vector2f(1.0F, 2.0F)};
        continue;
      }
      const TexelMap map = texel_map(views[chart.view].camera, layout.texels_per_pixel);
      const Eigen::Vector2f shift =
          page_origin -
          Eigen::Vector2f(static_cast<float>(chart.source_x), static_cast<float>(chart.source_y));
      for (std::size_t k = 0; k < 3; ++k) {
        layout.face_texels[face][k] = map(corners[face][k]) + shift;
      }
    }
  }
}

}  // namespace

Result<> AtlasOptions::validate() const {
  if (page_size_px < kSmallestPage || page_size_px > 16384 ||
      !std::has_single_bit(static_cast<unsigned>(page_size_px))) {
    return fail(ErrorCode::kInvalidArgument,
                "page_size_px is {}, must be a power of two in [64, 16384]",
                page_size_px);
  }
  if (max_pages < 1 || max_pages > 64) {
    return fail(ErrorCode::kInvalidArgument, "max_pages is {}, must be in [1, 64]", max_pages);
  }
  if (padding_px < 1 || padding_px > 64) {
    return fail(ErrorCode::kInvalidArgument, "padding_px is {}, must be in [1, 64]", padding_px);
  }
  if (!(texels_per_pixel > 0.0 && texels_per_pixel <= 1.0)) {
    return fail(
        ErrorCode::kInvalidArgument, "texels_per_pixel is {}, must be in (0, 1]", texels_per_pixel);
  }
  return {};
}

Eigen::Vector2i scaled_size(const Camera& camera, double texels_per_pixel) {
  return {std::max(1, static_cast<int>(std::lround(camera.width_px * texels_per_pixel))),
          std::max(1, static_cast<int>(std::lround(camera.height_px * texels_per_pixel)))};
}

Result<AtlasLayout> lay_out_atlas(const TriangleMesh& mesh,
                                  std::span<const DenseView> views,
                                  std::span<const std::uint32_t> labels,
                                  std::vector<Chart> charts,
                                  const AtlasOptions& options) {
  TM_RETURN_IF_ERROR(options.validate());
  const FaceCorners corners = picture_corners(mesh, views, charts);
  for (Chart& chart : charts) {
    find_rectangle(corners, views[chart.view].camera, options.texels_per_pixel, chart);
  }
  charts = merge_close_charts(std::move(charts), options.padding_px);
  std::vector<Chart> sheets = patch_sheets(labels);
  const std::size_t pictured_count = charts.size();
  charts.insert(
      charts.end(), std::make_move_iterator(sheets.begin()), std::make_move_iterator(sheets.end()));
  AtlasLayout layout;
  layout.charts = std::move(charts);
  layout.face_chart.resize(mesh.faces.size());
  layout.face_texels.resize(mesh.faces.size());
  const double lowest = options.texels_per_pixel * kLowestDensityShare;
  for (double density = options.texels_per_pixel; density >= lowest; density *= kDensityStep) {
    for (std::size_t c = 0; c < pictured_count; ++c) {
      Chart& chart = layout.charts[c];
      find_rectangle(corners, views[chart.view].camera, density, chart);
    }
    const auto packing = pack_charts(layout.charts, options, layout.page_size_px);
    if (!packing) {
      continue;
    }
    for (std::size_t c = 0; c < layout.charts.size(); ++c) {
      layout.charts[c].page = packing->places[c].page;
      layout.charts[c].page_x = packing->places[c].x + options.padding_px;
      layout.charts[c].page_y = packing->places[c].y + options.padding_px;
    }
    layout.page_count = packing->page_count;
    layout.texels_per_pixel = density;
    place_faces(corners, views, layout);
    return layout;
  }
  return fail(ErrorCode::kLimitExceeded,
              "cannot lay out {} charts on {} pages of {} texels, not even at a density of {:.3f}",
              layout.charts.size(),
              options.max_pages,
              options.page_size_px,
              lowest);
}

}  // namespace trigmesh
