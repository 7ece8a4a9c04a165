#include "sfm/texture/atlas_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "sfm/texture/face_views.hpp"
#include "sfm/texture/raster.hpp"

namespace trigmesh {
namespace {

constexpr float kOffsetUnits = 64.0F;  // offsets are kept in 1/64 grey level
constexpr int kSpreadIterations = 200;

enum class Texel : std::uint8_t {
  kOutside,
  kInside,  // its centre lies in a face
  kRim,     // touches one that is inside: bilinear look-ups at the border need it
  kQueued,  // painted from its neighbour
};

cv::Vec3b to_pixel(const Eigen::Vector3f& color) {
  return {cv::saturate_cast<std::uint8_t>(color[0]),
          cv::saturate_cast<std::uint8_t>(color[1]),
          cv::saturate_cast<std::uint8_t>(color[2])};
}

Eigen::Vector3f to_color(const cv::Vec3b& pixel) {
  return {static_cast<float>(pixel[0]), static_cast<float>(pixel[1]), static_cast<float>(pixel[2])};
}

/// One chart's rectangle with its padding, cut out of a page.
class ChartCanvas {
 public:
  ChartCanvas(const Chart& chart, int padding_px, cv::Mat& page)
      : origin_(static_cast<float>(chart.page_x - padding_px),
                static_cast<float>(chart.page_y - padding_px)),
        pixels_(page(cv::Rect(chart.page_x - padding_px,
                              chart.page_y - padding_px,
                              chart.width + 2 * padding_px,
                              chart.height + 2 * padding_px))),
        state_(pixels_.size(), CV_8UC1, cv::Scalar(0)),
        offsets_(pixels_.size(), CV_16SC3, cv::Scalar(0, 0, 0)) {}

  /// Marks the texels of a face and notes its offsets.
  void add_face(const std::array<Eigen::Vector2f, 3>& texels,
                const std::array<Eigen::Vector3f, 3>& offsets) {
    const std::array<Eigen::Vector2f, 3> corners{
        texels[0] - origin_, texels[1] - origin_, texels[2] - origin_};
    rasterize_triangle(
        corners, {pixels_.cols, pixels_.rows}, [&](int x, int y, const Eigen::Vector3f& weights) {
          const Eigen::Vector3f offset =
              weights[0] * offsets[0] + weights[1] * offsets[1] + weights[2] * offsets[2];
          state_.at<Texel>(y, x) = Texel::kInside;
          set_offset(x, y, offset);
        });
    if (texel_state(corners[0]) == Texel::kOutside) {
      // Faces between texel centres: at least the nearest texels show their picture.
      for (std::size_t i = 0; i < 3; ++i) {
        mark_corner(corners[i], offsets[i]);
      }
    }
  }

  /// Texels beside the marked ones keep their own picture with their neighbours' mean offset.
  void add_rim() {
    for (int y = 0; y < state_.rows; ++y) {
      for (int x = 0; x < state_.cols; ++x) {
        if (state_.at<Texel>(y, x) == Texel::kOutside && in_picture(x, y)) {
          join_rim(x, y);
        }
      }
    }
  }

  void apply(const ColorGain& gain) {
    for (int y = 0; y < state_.rows; ++y) {
      for (int x = 0; x < state_.cols; ++x) {
        if (state_.at<Texel>(y, x) == Texel::kOutside) {
          continue;
        }
        auto& pixel = pixels_.at<cv::Vec3b>(y, x);
        const auto& offset = offsets_.at<cv::Vec3s>(y, x);
        for (int c = 0; c < 3; ++c) {
          pixel[c] = cv::saturate_cast<std::uint8_t>(static_cast<float>(pixel[c]) *
                                                         gain[static_cast<std::size_t>(c)] +
                                                     static_cast<float>(offset[c]) / kOffsetUnits);
        }
      }
    }
  }

  /// Breadth first from the painted texels over all others.
  void spread() {
    std::vector<cv::Point> queue;
    for (int y = 0; y < state_.rows; ++y) {
      for (int x = 0; x < state_.cols; ++x) {
        if (state_.at<Texel>(y, x) != Texel::kOutside) {
          queue.emplace_back(x, y);
        }
      }
    }
    for (std::size_t next = 0; next < queue.size(); ++next) {
      const cv::Point from = queue[next];
      for (const cv::Point& step : {cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const cv::Point to = from + step;
        if (to.x >= 0 && to.y >= 0 && to.x < state_.cols && to.y < state_.rows &&
            state_.at<Texel>(to) == Texel::kOutside) {
          state_.at<Texel>(to) = Texel::kQueued;
          pixels_.at<cv::Vec3b>(to) = pixels_.at<cv::Vec3b>(from);
          queue.push_back(to);
        }
      }
    }
  }

  void limit_picture(int padding_px) {
    picture_ = cv::Rect(
        padding_px, padding_px, state_.cols - 2 * padding_px, state_.rows - 2 * padding_px);
  }

 private:
  [[nodiscard]] bool in_picture(int x, int y) const { return picture_.contains({x, y}); }

  [[nodiscard]] Texel texel_state(const Eigen::Vector2f& corner) const {
    const cv::Point texel(static_cast<int>(std::lround(corner.x())),
                          static_cast<int>(std::lround(corner.y())));
    return in_picture(texel.x, texel.y) ? state_.at<Texel>(texel) : Texel::kInside;
  }

  void mark_corner(const Eigen::Vector2f& corner, const Eigen::Vector3f& offset) {
    const int x = static_cast<int>(std::lround(corner.x()));
    const int y = static_cast<int>(std::lround(corner.y()));
    if (in_picture(x, y) && state_.at<Texel>(y, x) == Texel::kOutside) {
      state_.at<Texel>(y, x) = Texel::kInside;
      set_offset(x, y, offset);
    }
  }

  void set_offset(int x, int y, const Eigen::Vector3f& offset) {
    auto& stored = offsets_.at<cv::Vec3s>(y, x);
    for (int c = 0; c < 3; ++c) {
      stored[c] = cv::saturate_cast<std::int16_t>(offset[c] * kOffsetUnits);
    }
  }

  void join_rim(int x, int y) {
    cv::Vec3i sum(0, 0, 0);
    int count = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int nx = x + dx;
        const int ny = y + dy;
        if (nx >= 0 && ny >= 0 && nx < state_.cols && ny < state_.rows &&
            state_.at<Texel>(ny, nx) == Texel::kInside) {
          sum += cv::Vec3i(offsets_.at<cv::Vec3s>(ny, nx));
          ++count;
        }
      }
    }
    if (count > 0) {
      state_.at<Texel>(y, x) = Texel::kRim;
      for (int c = 0; c < 3; ++c) {
        offsets_.at<cv::Vec3s>(y, x)[c] = cv::saturate_cast<std::int16_t>(sum[c] / count);
      }
    }
  }

  Eigen::Vector2f origin_;
  cv::Mat pixels_;
  cv::Mat state_;    // Texel
  cv::Mat offsets_;  // CV_16SC3
  cv::Rect picture_;
};

Result<> copy_view(const AtlasLayout& layout,
                   const std::vector<std::size_t>& charts,
                   const ViewImage& image,
                   const Camera& camera,
                   std::vector<cv::Mat>& pages) {
  const Eigen::Vector2i size = scaled_size(camera, layout.texels_per_pixel);
  cv::Mat scaled = image.rgb;
  if (size.x() != image.rgb.cols || size.y() != image.rgb.rows) {
    cv::resize(image.rgb, scaled, cv::Size(size.x(), size.y()), 0.0, 0.0, cv::INTER_AREA);
  }
  for (const std::size_t c : charts) {
    const Chart& chart = layout.charts[c];
    const cv::Rect from(chart.source_x, chart.source_y, chart.width, chart.height);
    const cv::Rect to(chart.page_x, chart.page_y, chart.width, chart.height);
    cv::Mat target = pages[chart.page](to);
    scaled(from).copyTo(target);
  }
  return {};
}

/// Mean texture colour at the vertices of textured faces; their number, 0 elsewhere, in `counts`.
std::vector<Eigen::Vector3f> texture_at_vertices(const TriangleMesh& mesh,
                                                 const AtlasLayout& layout,
                                                 const std::vector<cv::Mat>& pages,
                                                 std::vector<int>& counts) {
  std::vector<Eigen::Vector3f> colors(mesh.positions.size(), Eigen::Vector3f::Zero());
  counts.assign(mesh.positions.size(), 0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Chart& chart = layout.charts[layout.face_chart[f]];
    if (chart.view == kNoLabel) {
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      colors[mesh.faces[f][k]] += sample_bilinear(pages[chart.page], layout.face_texels[f][k]);
      ++counts[mesh.faces[f][k]];
    }
  }
  for (std::size_t v = 0; v < colors.size(); ++v) {
    colors[v] /= static_cast<float>(std::max(1, counts[v]));
  }
  return colors;
}

/// Vertices of unseen faces, and what joins them.
std::vector<std::pair<std::uint32_t, std::uint32_t>> unseen_edges(const TriangleMesh& mesh,
                                                                  const AtlasLayout& layout) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Chart& chart : layout.charts) {
    if (chart.view != kNoLabel) {
      continue;
    }
    for (const std::uint32_t face : chart.faces) {
      for (std::size_t k = 0; k < 3; ++k) {
        edges.emplace_back(mesh.faces[face][k], mesh.faces[face][(k + 1) % 3]);
      }
    }
  }
  return edges;
}

}  // namespace

Eigen::Vector3f sample_bilinear(const cv::Mat& rgb, const Eigen::Vector2f& position) {
  const float x = std::clamp(position.x(), 0.0F, static_cast<float>(rgb.cols - 1));
  const float y = std::clamp(position.y(), 0.0F, static_cast<float>(rgb.rows - 1));
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, rgb.cols - 1);
  const int y1 = std::min(y0 + 1, rgb.rows - 1);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const Eigen::Vector3f above =
      (1.0F - fx) * to_color(rgb.at<cv::Vec3b>(y0, x0)) + fx * to_color(rgb.at<cv::Vec3b>(y0, x1));
  const Eigen::Vector3f below =
      (1.0F - fx) * to_color(rgb.at<cv::Vec3b>(y1, x0)) + fx * to_color(rgb.at<cv::Vec3b>(y1, x1));
  return (1.0F - fy) * above + fy * below;
}

Result<std::vector<cv::Mat>> copy_pictures(const AtlasLayout& layout,
                                           std::span<const DenseView> views,
                                           const ViewImageSource& images,
                                           Executor& executor) {
  std::vector<cv::Mat> pages;
  for (int p = 0; p < layout.page_count; ++p) {
    pages.emplace_back(
        layout.page_size_px, layout.page_size_px, CV_8UC3, cv::Scalar(128, 128, 128));
  }
  std::vector<std::vector<std::size_t>> charts_of_view(views.size());
  for (std::size_t c = 0; c < layout.charts.size(); ++c) {
    if (layout.charts[c].view != kNoLabel) {
      charts_of_view[layout.charts[c].view].push_back(c);
    }
  }
  std::vector<std::optional<Error>> errors(views.size());
  executor.for_each_index(views.size(), [&](std::size_t v) {
    if (charts_of_view[v].empty()) {
      return;
    }
    const auto copied = load_view(views, images, v).and_then([&](const ViewImage& image) {
      return copy_view(layout, charts_of_view[v], image, views[v].camera, pages);
    });
    if (!copied) {
      errors[v] = copied.error();
    }
  });
  for (auto& error : errors) {
    if (error) {
      return tl::unexpected<Error>(std::move(*error));
    }
  }
  return pages;
}

void finish_charts(const AtlasLayout& layout,
                   const std::vector<ColorGain>& gains,
                   const CornerOffsets& offsets,
                   int padding_px,
                   std::vector<cv::Mat>& pages,
                   Executor& executor) {
  executor.for_each_index(layout.charts.size(), [&](std::size_t c) {
    const Chart& chart = layout.charts[c];
    if (chart.view == kNoLabel) {
      return;
    }
    ChartCanvas canvas(chart, padding_px, pages[chart.page]);
    canvas.limit_picture(padding_px);
    for (const std::uint32_t face : chart.faces) {
      canvas.add_face(layout.face_texels[face], offsets[face]);
    }
    canvas.add_rim();
    canvas.apply(gains[chart.view]);
    canvas.spread();
  });
}

void paint_patches(const TriangleMesh& mesh,
                   const AtlasLayout& layout,
                   std::vector<cv::Mat>& pages) {
  const auto edges = unseen_edges(mesh, layout);
  std::vector<int> counts;
  std::vector<Eigen::Vector3f> colors = texture_at_vertices(mesh, layout, pages, counts);
  const auto own_color = [&](std::size_t v) -> Eigen::Vector3f {
    if (mesh.colors.empty()) {
      return Eigen::Vector3f::Constant(128.0F);
    }
    const auto& rgb = mesh.colors[v];
    return Eigen::Vector3f(rgb[0], rgb[1], rgb[2]);
  };
  // Differences of known vertices stay; the others relax to the mean of their neighbours.
  std::vector<Eigen::Vector3f> difference(colors.size(), Eigen::Vector3f::Zero());
  for (std::size_t v = 0; v < colors.size(); ++v) {
    if (counts[v] > 0) {
      difference[v] = colors[v] - own_color(v);
    }
  }
  std::vector<Eigen::Vector4f> sums(colors.size());
  for (int iteration = 0; iteration < kSpreadIterations && !edges.empty(); ++iteration) {
    std::fill(sums.begin(), sums.end(), Eigen::Vector4f::Zero());
    for (const auto& [a, b] : edges) {
      sums[a] += difference[b].homogeneous();
      sums[b] += difference[a].homogeneous();
    }
    for (std::size_t v = 0; v < colors.size(); ++v) {
      if (counts[v] == 0 && sums[v][3] > 0.0F) {
        difference[v] = sums[v].head<3>() / sums[v][3];
      }
    }
  }
  for (const Chart& chart : layout.charts) {
    for (std::size_t i = 0; chart.view == kNoLabel && i < chart.faces.size(); ++i) {
      std::array<Eigen::Vector3f, 3> corner;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh.faces[chart.faces[i]][k];
        corner[k] = own_color(v) + difference[v];
      }
      const Eigen::Vector2i first = Eigen::Vector2i(chart.page_x, chart.page_y) + patch_origin(i);
      for (int y = 0; y < kPatchSide; ++y) {
        for (int x = 0; x < kPatchSide; ++x) {
          const Eigen::Vector3f color = corner[0] +
                                        static_cast<float>(x - 1) * (corner[1] - corner[0]) +
                                        static_cast<float>(y - 1) * (corner[2] - corner[0]);
          pages[chart.page].at<cv::Vec3b>(first.y() + y, first.x() + x) = to_pixel(color);
        }
      }
    }
  }
}

}  // namespace trigmesh
