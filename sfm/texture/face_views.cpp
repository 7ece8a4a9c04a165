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

constexpr float kFlatGradient = 4.0F;        // grey levels; blank surfaces go by area and angle
constexpr float kSilhouetteQuality = 0.05F;  // of a face wholly inside the margin
constexpr float kMakeshiftQuality = 0.02F;   // of looks that are better than none
constexpr double kMakeshiftCosine = 0.05;
constexpr int kMostHiddenPixels = 16;          // of a makeshift look: more of a wrong thing shows
constexpr int kWorthSplittingPixels = 32;      // smaller faces are shown whole or not at all
constexpr float kDepthSlackFootprints = 1.5F;  // a z-buffer's own rounding
constexpr float kJumpFootprints = 4.0F;

struct SeenFace {
  std::uint32_t face = 0;
  bool makeshift = false;  ///< partly hidden or at a grazing angle
  FaceView view;
};

/// What one view sees.
struct ViewLooks {
  std::vector<SeenFace> seen;               ///< ascending by face
  std::vector<std::uint32_t> seen_in_part;  ///< likewise; enough of them that the rest is a pity
};

/// What the pixels of one face add up to.
struct PixelSums {
  int masked = 0;  ///< hidden or not
  int hidden = 0;
  int visible = 0;
  // Of the visible ones:
  int near_silhouette = 0;
  std::int64_t gradient = 0;
  std::array<std::int64_t, 3> color{};
};

/// One view's picture with what is derived from it.
struct ViewRasters {
  std::uint32_t number = 0;
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
  // A step of s along the axis is s / depth * focal footprints of a pixel.
  const float behind = (view.inverse_depth.at<float>(y, x) / inverse_depth - 1.0F) * view.focal_px;
  if (!view.mask.empty() && view.mask.at<std::uint8_t>(y, x) == 0) {
    ++sums.masked;
    return;
  }
  if (behind > kDepthSlackFootprints) {
    ++sums.hidden;
    return;
  }
  ++sums.visible;
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
  return sums;
}

/// Of a face without a pixel, smaller than the grid: the pixel in which its middle lies.
PixelSums middle_pixel(const ViewRasters& view, const ProjectedFace& face) {
  PixelSums sums;
  const Eigen::Vector2f middle =
      (face.corners_px[0] + face.corners_px[1] + face.corners_px[2]) / 3.0F;
  add_pixel(view,
            static_cast<int>(std::lround(middle.x())),
            static_cast<int>(std::lround(middle.y())),
            face.inverse_depth.mean(),
            sums);
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
  const auto visible = static_cast<float>(sums.visible);
  const float sharpness = static_cast<float>(sums.gradient) / visible + kFlatGradient;
  const float clear = 1.0F - static_cast<float>(sums.near_silhouette) / visible;
  const float shown = visible / static_cast<float>(sums.visible + sums.hidden);
  return std::max(area_px, 1e-6F) * static_cast<float>(cosine) * sharpness * shown * shown *
         (kSilhouetteQuality + (1.0F - kSilhouetteQuality) * clear);
}

ViewRasters rasters_of(const TriangleMesh& mesh,
                       const ProjectedMesh& projected,
                       const Camera& camera,
                       const ViewImage& image,
                       int silhouette_margin_px) {
  ViewRasters rasters{
      .number = 0,
      .rgb = image.rgb,
      .mask = image.mask,
      .gradient = gradient_image(image.rgb),
      .inverse_depth = render_inverse_depth(mesh, projected, {camera.width_px, camera.height_px}),
      .silhouettes = {},
      .focal_px = static_cast<float>(camera.fx_px)};
  rasters.silhouettes = silhouette_mask(rasters.inverse_depth, camera.fx_px, silhouette_margin_px);
  return rasters;
}

/// Whether a face lies across the camera's plane and reaches into the picture.
bool reaches_in(const ProjectedFace& face, PixelBounds bounds) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2f& p = face.corners_px[i];
    if (face.inverse_depth[static_cast<Eigen::Index>(i)] > 0.0F && p.x() >= 0.0F && p.y() >= 0.0F &&
        p.x() < static_cast<float>(bounds.width) && p.y() < static_cast<float>(bounds.height)) {
      return true;
    }
  }
  return false;
}

FaceView face_view(std::uint32_t view, const PixelSums& sums, float quality) {
  FaceView result{.view = view, .quality = quality, .color = {}};
  for (std::size_t c = 0; c < 3; ++c) {
    result.color[c] = static_cast<std::uint16_t>(static_cast<float>(sums.color[c]) /
                                                 static_cast<float>(sums.visible) * kColorUnits);
  }
  return result;
}

/// Adds what a view sees of one face that looks at it.
void look_at_face(const ProjectedFace& face,
                  std::uint32_t number,
                  double cosine,
                  const ViewRasters& view,
                  double min_view_cosine,
                  ViewLooks& looks) {
  const PixelBounds bounds{view.rgb.cols, view.rgb.rows};
  if (!face.in_front) {
    if (reaches_in(face, bounds)) {
      looks.seen_in_part.push_back(number);
    }
    return;
  }
  const float area_px = -0.5F * doubled_area_px(face);
  if (!(area_px > 0.0F)) {
    return;
  }
  const bool in_picture = inside(face, bounds);
  PixelSums sums = sum_pixels(view, face, bounds);
  if (in_picture && sums.visible + sums.hidden + sums.masked == 0) {
    sums = middle_pixel(view, face);
  }
  const bool whole = in_picture && sums.masked == 0 && sums.hidden == 0;
  if (!whole && sums.visible >= kWorthSplittingPixels) {
    looks.seen_in_part.push_back(number);
  }
  if (in_picture && sums.masked == 0 && sums.hidden <= std::min(sums.visible, kMostHiddenPixels)) {
    const bool makeshift = !whole || cosine < min_view_cosine;
    const float quality =
        face_quality(sums, area_px, cosine) * (makeshift ? kMakeshiftQuality : 1.0F);
    looks.seen.push_back({number, makeshift, face_view(view.number, sums, quality)});
  }
}

ViewLooks look_from(const TriangleMesh& mesh,
                    const DenseView& view,
                    std::uint32_t number,
                    const ViewImage& image,
                    const VisibilityOptions& options) {
  const ProjectedMesh projected = project_mesh(mesh, view.camera, view.cam_from_world);
  ViewRasters rasters =
      rasters_of(mesh, projected, view.camera, image, options.silhouette_margin_px);
  rasters.number = number;
  const Eigen::Vector3d camera = camera_center(view.cam_from_world);
  ViewLooks looks;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const double cosine = view_cosine(mesh, f, camera);
    if (cosine >= kMakeshiftCosine) {
      look_at_face(
          project_face(mesh, projected, f), f, cosine, rasters, options.min_view_cosine, looks);
    }
  }
  return looks;
}

/// Faces that some view sees in part and no view sees well.
std::vector<std::uint32_t> faces_to_split(const std::vector<ViewLooks>& by_view,
                                          std::size_t face_count) {
  std::vector<std::uint8_t> wanted(face_count, 0);
  for (const ViewLooks& looks : by_view) {
    for (const std::uint32_t face : looks.seen_in_part) {
      wanted[face] = 1;
    }
  }
  for (const ViewLooks& looks : by_view) {
    for (const SeenFace& entry : looks.seen) {
      wanted[entry.face] &= entry.makeshift ? 1 : 0;
    }
  }
  std::vector<std::uint32_t> faces;
  for (std::uint32_t f = 0; f < face_count; ++f) {
    if (wanted[f] != 0) {
      faces.push_back(f);
    }
  }
  return faces;
}

FaceViews gather(const std::vector<ViewLooks>& by_view, std::size_t face_count) {
  FaceViews result;
  result.offsets.assign(face_count + 1, 0);
  for (const ViewLooks& looks : by_view) {
    for (const SeenFace& entry : looks.seen) {
      ++result.offsets[entry.face + 1];
    }
  }
  for (std::size_t f = 0; f < face_count; ++f) {
    result.offsets[f + 1] += result.offsets[f];
  }
  result.entries.resize(result.offsets.back());
  std::vector<std::size_t> next(result.offsets.begin(), result.offsets.end() - 1);
  for (const ViewLooks& looks : by_view) {
    for (const SeenFace& entry : looks.seen) {
      result.entries[next[entry.face]++] = entry.view;
    }
  }
  result.worth_splitting = faces_to_split(by_view, face_count);
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
  std::vector<ViewLooks> by_view(views.size());
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
