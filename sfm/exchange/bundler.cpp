#include "sfm/exchange/bundler.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <vector>

#include <fmt/compile.h>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "sfm/exchange/colmap_model.hpp"
#include "sfm/exchange/image_paths.hpp"

namespace trigmesh {
namespace {

using Buffer = fmt::memory_buffer;

template <typename Values>
void append_line(Buffer& out, const Values& values) {
  std::string_view separator = "";
  for (const double value : values) {
    fmt::format_to(std::back_inserter(out), FMT_COMPILE("{}{}"), separator, value);
    separator = " ";
  }
  out.push_back('\n');
}

double mean_focal(const Camera& camera) {
  return 0.5 * (camera.fx_px + camera.fy_px);
}

Result<> check_camera(const Camera& camera, std::size_t position) {
  constexpr double kLargestError_px = 0.1;
  const bool tangential = camera.distortion[2] != 0.0 || camera.distortion[3] != 0.0;
  if (camera.model == CameraModel::kKannalaBrandt || tangential) {
    return fail(ErrorCode::kUnsupported,
                "camera {} has a lens ({}) that Bundler cannot describe: export as colmap-text or "
                "nerfstudio",
                position + 1,
                to_string(camera.model));
  }
  const double half_side_px = 0.5 * std::max(camera.width_px, camera.height_px);
  const double error_px =
      half_side_px * std::abs(camera.fx_px - camera.fy_px) / (2.0 * mean_focal(camera));
  if (error_px > kLargestError_px) {
    return fail(
        ErrorCode::kUnsupported,
        "camera {} has two focal lengths (fx={}, fy={}) and Bundler has room for one, which "
        "would be off by {:.2f} pixels at the border: export as colmap-text or nerfstudio",
        position + 1,
        camera.fx_px,
        camera.fy_px,
        error_px);
  }
  return {};
}

void append_camera(Buffer& out, const Camera& camera, const Rigid3& cam_from_world) {
  // Bundler's camera frame from ours: half a turn about x.
  const Eigen::Vector3d flip(1.0, -1.0, -1.0);
  const Eigen::Matrix3d rotation = flip.asDiagonal() * cam_from_world.rotation.toRotationMatrix();
  append_line(out, Eigen::Vector3d(mean_focal(camera), camera.distortion[0], camera.distortion[1]));
  for (Eigen::Index row = 0; row < 3; ++row) {
    append_line(out, Eigen::Vector3d(rotation.row(row)));
  }
  append_line(out, Eigen::Vector3d(flip.asDiagonal() * cam_from_world.translation));
}

void append_point(Buffer& out,
                  const Scene& scene,
                  const Landmark& landmark,
                  const std::vector<std::size_t>& numbers) {
  append_line(out, landmark.position_in_world);
  const auto& [red, green, blue] = landmark.color_rgb;
  fmt::format_to(std::back_inserter(out),
                 FMT_COMPILE("{} {} {}\n{}"),
                 red,
                 green,
                 blue,
                 landmark.track.size());
  for (const Observation& observation : landmark.track) {
    const View& view = scene.views[index(observation.view)];
    const Camera& camera = scene.cameras[index(view.camera)];
    const Eigen::Vector2d pixel = view.keypoints_px[index(observation.feature)].cast<double>();
    fmt::format_to(std::back_inserter(out),
                   FMT_COMPILE(" {} {} {} {}"),
                   numbers[index(observation.view)],
                   index(observation.feature),
                   pixel.x() - camera.cx_px,
                   camera.cy_px - pixel.y());
  }
  out.push_back('\n');
}

}  // namespace

Result<BundlerText> write_bundler(const Scene& scene, std::string_view image_folder) {
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    TM_RETURN_IF_ERROR(check_camera(scene.cameras[i], i));
  }
  Buffer bundle;
  Buffer list;
  fmt::format_to(std::back_inserter(bundle),
                 "# Bundle file v0.3\n{} {}\n",
                 scene.registered_count(),
                 scene.landmarks.size());
  std::vector<std::size_t> numbers(scene.views.size(), 0);
  std::size_t next = 0;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    if (!view.cam_from_world) {
      continue;
    }
    TM_RETURN_IF_ERROR(check_colmap_name(view.name));
    numbers[i] = next++;
    append_camera(bundle, scene.cameras[index(view.camera)], *view.cam_from_world);
    fmt::format_to(std::back_inserter(list), "{}\n", image_path(image_folder, view.name));
  }
  for (const Landmark& landmark : scene.landmarks) {
    append_point(bundle, scene, landmark, numbers);
  }
  return BundlerText{fmt::to_string(bundle), fmt::to_string(list)};
}

}  // namespace trigmesh
