#include "sfm/dense/undistortion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include <Eigen/Core>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

/// Largest side of the undistorted picture over that of the lens's.
constexpr double kMaxGrowth = 1.5;

/// Extent of the normalised coordinates of the outermost pixels.
struct RayBox {
  Eigen::Vector2d low = Eigen::Vector2d::Zero();
  Eigen::Vector2d high = Eigen::Vector2d::Zero();
};

RayBox border_rays(const Camera& camera) {
  RayBox box;
  const auto add = [&](double x, double y) {
    if (const std::optional<Eigen::Vector2d> ray = normalize_pixel(camera, {x, y})) {
      box.low = box.low.cwiseMin(*ray);
      box.high = box.high.cwiseMax(*ray);
    }
  };
  for (int x = 0; x < camera.width_px; ++x) {
    add(x, 0.0);
    add(x, camera.height_px - 1.0);
  }
  for (int y = 0; y < camera.height_px; ++y) {
    add(0.0, y);
    add(camera.width_px - 1.0, y);
  }
  return box;
}

/// First pixel and count along one axis, relative to the principal point.
struct Extent {
  double first_px = 0.0;
  int count_px = 0;
};

Extent extent_of(double low, double high, double focal_px, int lens_px) {
  const double limit = 0.5 * (kMaxGrowth - 1.0) * lens_px;
  const double reach = 0.5 * lens_px + limit;
  const double first = std::floor(std::max(low * focal_px, -reach));
  const double last = std::ceil(std::min(high * focal_px, reach));
  return {first, std::max(1, static_cast<int>(last - first) + 1)};
}

cv::Mat lens_coordinates(const Camera& camera, const Camera& pinhole) {
  cv::Mat map(pinhole.height_px, pinhole.width_px, CV_32FC2);
  const cv::Vec2f outside(-10.0F, -10.0F);
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const Eigen::Vector3d ray(
          (x - pinhole.cx_px) / pinhole.fx_px, (y - pinhole.cy_px) / pinhole.fy_px, 1.0);
      const std::optional<Eigen::Vector2d> pixel = project(camera, ray);
      // A lens polynomial may fold back far outside of the picture: only its invertible part
      // counts.
      const std::optional<Eigen::Vector2d> back = pixel && pixel->x() > -1.0 && pixel->y() > -1.0 &&
                                                          pixel->x() < camera.width_px &&
                                                          pixel->y() < camera.height_px
                                                      ? normalize_pixel(camera, *pixel)
                                                      : std::nullopt;
      constexpr double kSameRay = 1e-3;
      const bool seen = back && (*back - ray.head<2>()).norm() < kSameRay;
      map.at<cv::Vec2f>(y, x) =
          seen ? cv::Vec2f(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()))
               : outside;
    }
  }
  return map;
}

/// 255 where all four pixels that a sample reads are in the picture (a hair of rounding allowed).
cv::Mat seen_mask(const cv::Mat& map, const Camera& camera) {
  constexpr float kSlack_px = 1e-3F;
  cv::Mat mask(map.rows, map.cols, CV_8UC1);
  const float max_x = static_cast<float>(camera.width_px - 1) + kSlack_px;
  const float max_y = static_cast<float>(camera.height_px - 1) + kSlack_px;
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const auto& p = map.at<cv::Vec2f>(y, x);
      const bool seen = p[0] >= -kSlack_px && p[1] >= -kSlack_px && p[0] <= max_x && p[1] <= max_y;
      mask.at<std::uint8_t>(y, x) = seen ? 255 : 0;
    }
  }
  return mask;
}

}  // namespace

Camera undistorted_camera(const Camera& camera) {
  if (camera.model == CameraModel::kPinhole) {
    return camera;
  }
  const RayBox box = border_rays(camera);
  const Extent across = extent_of(box.low.x(), box.high.x(), camera.fx_px, camera.width_px);
  const Extent down = extent_of(box.low.y(), box.high.y(), camera.fy_px, camera.height_px);
  return {.model = CameraModel::kPinhole,
          .width_px = across.count_px,
          .height_px = down.count_px,
          .fx_px = camera.fx_px,
          .fy_px = camera.fy_px,
          .cx_px = -across.first_px,
          .cy_px = -down.first_px,
          .distortion = {}};
}

Camera scaled_pinhole(const Camera& camera, int width_px, int height_px) {
  TM_CHECK(camera.model == CameraModel::kPinhole && width_px > 0 && height_px > 0);
  if (width_px == camera.width_px && height_px == camera.height_px) {
    return camera;
  }
  const double scale_x = static_cast<double>(width_px) / camera.width_px;
  const double scale_y = static_cast<double>(height_px) / camera.height_px;
  Camera out = camera;
  out.width_px = width_px;
  out.height_px = height_px;
  out.fx_px = camera.fx_px * scale_x;
  out.fy_px = camera.fy_px * scale_y;
  out.cx_px = (camera.cx_px + 0.5) * scale_x - 0.5;
  out.cy_px = (camera.cy_px + 0.5) * scale_y - 0.5;
  return out;
}

Result<ViewImage> undistort_image(const ViewImage& image,
                                  const Camera& camera,
                                  const Camera& pinhole) {
  const cv::Size size(camera.width_px, camera.height_px);
  if (image.rgb.type() != CV_8UC3 || image.rgb.size() != size) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot undistort a picture of {}x{} pixels with a camera of {}x{}",
                image.rgb.cols,
                image.rgb.rows,
                camera.width_px,
                camera.height_px);
  }
  if (!image.mask.empty() && (image.mask.type() != CV_8UC1 || image.mask.size() != size)) {
    return fail(ErrorCode::kInvalidArgument,
                "mask of {}x{} pixels for a picture of {}x{}",
                image.mask.cols,
                image.mask.rows,
                camera.width_px,
                camera.height_px);
  }
  if (camera == pinhole) {
    return image;
  }
  const cv::Mat map = lens_coordinates(camera, pinhole);
  ViewImage out;
  out.mask = seen_mask(map, camera);
  cv::remap(image.rgb, out.rgb, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  if (!image.mask.empty()) {
    cv::Mat mask;
    cv::remap(image.mask, mask, map, cv::noArray(), cv::INTER_NEAREST, cv::BORDER_CONSTANT);
    out.mask.setTo(0, mask == 0);
  }
  out.rgb.setTo(cv::Scalar(0, 0, 0), out.mask == 0);
  return out;
}

Result<cv::Mat> distort_mask(const cv::Mat& mask,
                             const Camera& pinhole,
                             const Camera& camera,
                             std::uint8_t outside) {
  if (mask.type() != CV_8UC1 || mask.cols != pinhole.width_px || mask.rows != pinhole.height_px) {
    return fail(ErrorCode::kInvalidArgument,
                "mask of {}x{} pixels for a picture of {}x{}",
                mask.cols,
                mask.rows,
                pinhole.width_px,
                pinhole.height_px);
  }
  if (camera == pinhole) {
    return mask;
  }
  cv::Mat result(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(outside));
  for (int y = 0; y < result.rows; ++y) {
    for (int x = 0; x < result.cols; ++x) {
      const std::optional<Eigen::Vector2d> ray = normalize_pixel(camera, Eigen::Vector2d(x, y));
      if (!ray) {
        continue;
      }
      const double u = std::round(pinhole.fx_px * ray->x() + pinhole.cx_px);
      const double v = std::round(pinhole.fy_px * ray->y() + pinhole.cy_px);
      if (u >= 0.0 && v >= 0.0 && u < mask.cols && v < mask.rows) {
        result.at<std::uint8_t>(y, x) =
            mask.at<std::uint8_t>(static_cast<int>(v), static_cast<int>(u));
      }
    }
  }
  return result;
}

std::vector<DenseView> dense_views(const Scene& scene) {
  std::vector<DenseView> views;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const View& view = scene.views[v];
    if (view.cam_from_world) {
      views.push_back(
          {.name = view.name,
           .camera = undistorted_camera(scene.cameras[static_cast<std::size_t>(view.camera)]),
           .cam_from_world = *view.cam_from_world,
           .source = ViewId{static_cast<std::uint32_t>(v)}});
    }
  }
  return views;
}

}  // namespace trigmesh
