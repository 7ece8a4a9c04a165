#include "sfm/texture/face_views.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "sfm/texture/mesh_projection.hpp"

namespace trigmesh {
namespace {

constexpr float kFlatGradient = 4.0F;          // grey levels; blank surfaces go by area and angle
constexpr float kSilhouetteQuality = 0.05F;    // of a face wholly inside the margin
constexpr float kDepthSlackFootprints = 1.5F;  // a z-buffer's own rounding
constexpr float kJumpFootprints = 4.0F;

struct SeenFace {
  std::uint32_t face = 0;
  FaceView view;
};

/// What the pixels of one face add up to.
struct PixelSums {
  int pixels = 0;
  int hidden = 0;
  int masked = 0;
  int near_silhouette = 0;
  std::int64_t gradient = 0;
  std::array<std::int64_t, 3> color{};
};

/// One view's picture with what is derived from it.
struct ViewRasters {
  cv::Mat rgb;
  cv::Mat mask;
  cv::Mat gradient;       // CV_8UC1
  cv::Mat inverse_depth;  // CV_32FC1
  cv::Mat silhouettes;    // CV_8UC1
  float focal_px = 0.0F;
};

/// Mean of |d/dx| and |d/dy| of the grey picture, after the slight blur of Sobel's kernel.
cv::Mat gradient_image(const cv::Mat& rgb) {
  cv::Mat grey;
  cv::Mat dx;
  cv::Mat dy;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  cv::Sobel(grey, dx, CV_16S, 1, 0);
  cv::Sobel(grey, dy, CV_16S, 0, 1);
  cv::convertScaleAbs(dx, dx, 0.125);
  cv::convertScaleAbs(dy, dy, 0.125);
  cv::Mat gradient;
  cv::addWeighted(dx, 0.5, dy, 0.5, 0.0, gradient);
  return gradient;
}

void add_pixel(const ViewRasters& view, int x, int y, float inverse_depth, PixelSums& sums) {
  ++sums.pixels;
  // A step of s along the axis is s / depth * focal footprints of a pixel.
  const float behind = (view.inverse_depth.at<float>(y, x) / inverse_depth - 1.0F) * view.focal_px;
  sums.hidden += behind > kDepthSlackFootprints ? 1 : 0;
  sums.masked += (!view.mask.empty() && view.mask.at<std::uint8_t>(y, x) == 0) ? 1 : 0;
  sums.near_silhouette += view.silhouettes.at<std::uint8_t>(y, x) != 0 ? 1 : 0;
  sums.gradient += view.gradient.at<std::uint8_t>(y, x);
  const auto& rgb = view.rgb.at<cv::Vec3b>(y, x);
  for (std::size_t c = 0; c < 3; ++c) {
    sums.color[c] += rgb[static_cast<int>(c)];
  }
}

bool inside(const ProjectedFace& face, PixelBounds bounds) {
  return std::all_of(face.corners_px.begin(), face.corners_px.end(), [&](const auto& p) {
    return p.x() >= 1.0F && p.y() >= 1.0F && p.x() <= static_cast<float>(bounds.width - 2) &&
           p.y() <= static_cast<float>(bounds.height - 2);
  });
}

PixelSums sum_pixels(const ViewRasters& view, const ProjectedFace& face, PixelBounds bounds) {
  PixelSums sums;
  rasterize_triangle(face.corners_px, bounds, [&](int x, int y, const Eigen::Vector3f& weights) {
    add_pixel(view, x, y, weights.dot(face.inverse_depth), sums);
  });
  if (sums.pixels == 0) {  // smaller than the grid: look at the pixel in which its middle lies
    const Eigen::Vector2f middle =
        (face.corners_px[0] + face.corners_px[1] + face.corners_px[2]) / 3.0F;
    add_pixel(view,
              static_cast<int>(std::lround(middle.x())),
              static_cast<int>(std::lround(middle.y())),
              face.inverse_depth.mean(),
              sums);
  }
  return sums;
}

/// Cosine between the outward normal and the direction from the face to the camera.
double view_cosine(const TriangleMesh& mesh, std::size_t face, const Eigen::Vector3d& camera) {
  const auto& v = mesh.faces[face];
  const Eigen::Vector3d a = mesh.positions[v[0]].cast<double>();
  const Eigen::Vector3d b = mesh.positions[v[1]].cast<double>();
  const Eigen::Vector3d c = mesh.positions[v[2]].cast<double>();
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const Eigen::Vector3d to_camera = camera - (a + b + c) / 3.0;
  const double lengths = normal.norm() * to_camera.norm();
  return lengths > 0.0 ? normal.dot(to_camera) / lengths : 0.0;
}

float face_quality(const PixelSums& sums, float area_px, double cosine) {
  const auto pixels = static_cast<float>(sums.pixels);
  const float sharpness = static_cast<float>(sums.gradient) / pixels + kFlatGradient;
  const float clear = 1.0F - static_cast<float>(sums.near_silhouette) / pixels;
  return std::max(area_px, 1e-6F) * static_cast<float>(cosine) * sharpness *
         (kSilhouetteQuality + (1.0F - kSilhouetteQuality) * clear);
}

std::vector<SeenFace> look_from(const TriangleMesh& mesh,
                                const DenseView& view,
                                std::uint32_t index,
                                const ViewImage& image,
                                const VisibilityOptions& options) {
  const PixelBounds bounds{view.camera.width_px, view.camera.height_px};
  const ProjectedMesh projected = project_mesh(mesh, view.camera, view.cam_from_world);
  ViewRasters rasters{.rgb = image.rgb,
                      .mask = image.mask,
                      .gradient = gradient_image(image.rgb),
                      .inverse_depth = render_inverse_depth(mesh, projected, bounds),
                      .silhouettes = {},
                      .focal_px = static_cast<float>(view.camera.fx_px)};
  rasters.silhouettes =
      silhouette_mask(rasters.inverse_depth, view.camera.fx_px, options.silhouette_margin_px);
  const Eigen::Vector3d camera = camera_center(view.cam_from_world);
  std::vector<SeenFace> seen;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const ProjectedFace face = project_face(mesh, projected, f);
    const float area_px = -0.5F * doubled_area_px(face);
    if (!face.in_front || !(area_px > 0.0F) || !inside(face, bounds)) {
      continue;
    }
    const double cosine = view_cosine(mesh, f, camera);
    if (cosine < options.min_view_cosine) {
      continue;
    }
    const PixelSums sums = sum_pixels(rasters, face, bounds);
    if (sums.hidden > 0 || sums.masked > 0) {
      continue;
    }
    SeenFace& entry = seen.emplace_back();
    entry.face = static_cast<std::uint32_t>(f);
    entry.view = {.view = index, .quality = face_quality(sums, area_px, cosine), .color = {}};
    for (std::size_t c = 0; c < 3; ++c) {
      entry.view.color[c] = static_cast<std::uint16_t>(
          static_cast<float>(sums.color[c]) / static_cast<float>(sums.pixels) * kColorUnits);
    }
  }
  return seen;
}

FaceViews gather(const std::vector<std::vector<SeenFace>>& by_view, std::size_t face_count) {
  FaceViews result;
  result.offsets.assign(face_count + 1, 0);
  for (const auto& seen : by_view) {
    for (const SeenFace& entry : seen) {
      ++result.offsets[entry.face + 1];
    }
  }
  for (std::size_t f = 0; f < face_count; ++f) {
    result.offsets[f + 1] += result.offsets[f];
  }
  result.entries.resize(result.offsets.back());
  std::vector<std::size_t> next(result.offsets.begin(), result.offsets.end() - 1);
  for (const auto& seen : by_view) {
    for (const SeenFace& entry : seen) {
      result.entries[next[entry.face]++] = entry.view;
    }
  }
  return result;
}

}  // namespace

Result<> VisibilityOptions::validate() const {
  if (!(min_view_cosine > 0.0 && min_view_cosine < 1.0)) {
    return fail(
        ErrorCode::kInvalidArgument, "min_view_cosine is {}, must be in (0, 1)", min_view_cosine);
  }
  if (silhouette_margin_px < 0 || silhouette_margin_px > 64) {
    return fail(ErrorCode::kInvalidArgument,
                "silhouette_margin_px is {}, must be in [0, 64]",
                silhouette_margin_px);
  }
  return {};
}

cv::Mat silhouette_mask(const cv::Mat& inverse_depth, double focal_px, int margin_px) {
  cv::Mat mask(inverse_depth.size(), CV_8UC1, cv::Scalar(0));
  const auto focal = static_cast<float>(focal_px);
  for (int y = 1; y + 1 < mask.rows; ++y) {
    const auto* above = inverse_depth.ptr<float>(y - 1);
    const auto* row = inverse_depth.ptr<float>(y);
    const auto* below = inverse_depth.ptr<float>(y + 1);
    auto* out = mask.ptr<std::uint8_t>(y);
    for (int x = 1; x + 1 < mask.cols; ++x) {
      // Inverse depth of a plane is linear in the picture: its second difference is zero.
      const float bend = std::max(std::abs(row[x - 1] - 2.0F * row[x] + row[x + 1]),
                                  std::abs(above[x] - 2.0F * row[x] + below[x]));
      out[x] = (row[x] > 0.0F && bend * focal > kJumpFootprints * row[x]) ? 255 : 0;
    }
  }
  if (margin_px > 0) {
    const int side = 2 * margin_px + 1;
    cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(side, side)));
  }
  return mask;
}

Result<ViewImage> load_view(std::span<const DenseView> views,
                            const ViewImageSource& images,
                            std::size_t view) {
  TM_ASSIGN_OR_RETURN(ViewImage image, images.load(view));
  const Camera& camera = views[view].camera;
  const cv::Size size(camera.width_px, camera.height_px);
  const bool mask_fits =
      image.mask.empty() || (image.mask.size() == size && image.mask.type() == CV_8UC1);
  if (image.rgb.size() != size || image.rgb.type() != CV_8UC3 || !mask_fits) {
    return fail(
        ErrorCode::kInvalidArgument,
        "cannot texture from {}: its picture or mask is not {}x{} pixels as its camera says",
        views[view].name,
        size.width,
        size.height);
  }
  return image;
}

Result<FaceViews> find_face_views(const TriangleMesh& mesh,
                                  std::span<const DenseView> views,
                                  const ViewImageSource& images,
                                  const VisibilityOptions& options,
                                  Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  std::vector<std::vector<SeenFace>> by_view(views.size());
  std::vector<std::optional<Error>> errors(views.size());
  executor.for_each_index(views.size(), [&](std::size_t v) {
    auto image = load_view(views, images, v);
    if (!image) {
      errors[v] = std::move(image).error();
      return;
    }
    by_view[v] = look_from(mesh, views[v], static_cast<std::uint32_t>(v), *image, options);
  });
  for (auto& error : errors) {
    if (error) {
      return tl::unexpected<Error>(std::move(*error));
    }
  }
  return gather(by_view, mesh.faces.size());
}

}  // namespace trigmesh
