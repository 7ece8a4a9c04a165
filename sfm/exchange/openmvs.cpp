#include "sfm/exchange/openmvs.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "firmware/base/check.hpp"
#include "sfm/exchange/byte_io.hpp"
#include "sfm/exchange/image_paths.hpp"

namespace trigmesh {
namespace {

constexpr std::uint32_t kVersion = 7;

/// Where each view is written: its image number, and its pose number on the platform of its camera.
struct ViewNumbers {
  std::uint32_t image = 0;
  std::uint32_t pose = 0;
};

void append_count(ByteWriter& out, std::size_t count) {
  out.value<std::uint64_t>(count);
}

void append_text(ByteWriter& out, std::string_view text) {
  append_count(out, text.size());
  out.text(text);
}

template <typename Derived>
void append_row_major(ByteWriter& out, const Eigen::MatrixBase<Derived>& matrix) {
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      out.value<double>(matrix(row, column));
    }
  }
}

std::vector<ViewNumbers> number_views(const Scene& scene) {
  std::vector<ViewNumbers> numbers(scene.views.size());
  std::vector<std::uint32_t> poses(scene.cameras.size(), 0);
  std::uint32_t images = 0;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].cam_from_world) {
      numbers[i] = {images++, poses[index(scene.views[i].camera)]++};
    }
  }
  return numbers;
}

void append_platform(ByteWriter& out, const Scene& scene, std::size_t position) {
  const Camera& camera = scene.cameras[position];
  append_text(out, fmt::format("platform{}", position + 1));
  append_count(out, 1);  // cameras on it
  append_text(out, fmt::format("camera{}", position + 1));
  append_text(out, "");  // band
  out.value<std::uint32_t>(static_cast<std::uint32_t>(camera.width_px));
  out.value<std::uint32_t>(static_cast<std::uint32_t>(camera.height_px));
  append_row_major(out, camera.calibration_matrix());
  append_row_major(out, Eigen::Matrix3d::Identity());  // the camera sits in the platform's frame
  append_row_major(out, Eigen::Vector3d::Zero());
  const auto belongs = [&](const View& view) {
    return view.cam_from_world && index(view.camera) == position;
  };
  append_count(out, static_cast<std::size_t>(std::ranges::count_if(scene.views, belongs)));
  for (const View& view : scene.views) {
    if (belongs(view)) {
      append_row_major(out, view.cam_from_world->rotation.toRotationMatrix());
      append_row_major(out, camera_center(*view.cam_from_world));
    }
  }
}

void append_image(ByteWriter& out,
                  const View& view,
                  std::size_t position,
                  ViewNumbers numbers,
                  std::string_view image_folder) {
  append_text(out, image_path(image_folder, view.name));
  append_text(out, "");  // mask
  out.value<std::uint32_t>(static_cast<std::uint32_t>(index(view.camera)));
  out.value<std::uint32_t>(0);  // camera of the platform
  out.value<std::uint32_t>(numbers.pose);
  out.value<std::uint32_t>(static_cast<std::uint32_t>(position));
  for (int i = 0; i < 3; ++i) {
    out.value<float>(0.0F);  // smallest, average, largest depth: OpenMVS works them out
  }
  append_count(out, 0);  // neighbours: the same
}

void append_vertices(ByteWriter& out, const Scene& scene, const std::vector<ViewNumbers>& numbers) {
  append_count(out, scene.landmarks.size());
  for (const Landmark& landmark : scene.landmarks) {
    for (const double value : landmark.position_in_world) {
      out.value<float>(static_cast<float>(value));
    }
    append_count(out, landmark.track.size());
    for (const Observation& observation : landmark.track) {
      out.value<std::uint32_t>(numbers[index(observation.view)].image);
      out.value<float>(0.0F);  // confidence unknown
    }
  }
  append_count(out, 0);  // normals
  append_count(out, scene.landmarks.size());
  for (const Landmark& landmark : scene.landmarks) {
    const auto& [red, green, blue] = landmark.color_rgb;
    out.value<std::uint8_t>(blue);
    out.value<std::uint8_t>(green);
    out.value<std::uint8_t>(red);
  }
}

Result<> check_cameras(const Scene& scene) {
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    if (std::ranges::any_of(scene.cameras[i].distortion, [](double d) { return d != 0.0; })) {
      return fail(
          ErrorCode::kUnsupported,
          "camera {} has lens distortion ({}), and OpenMVS needs undistorted images: export "
          "as colmap-text, run COLMAP's image_undistorter and OpenMVS's InterfaceCOLMAP",
          i + 1,
          to_string(scene.cameras[i].model));
    }
  }
  return {};
}

}  // namespace

Result<std::string> write_openmvs(const Scene& scene, std::string_view image_folder) {
  TM_RETURN_IF_ERROR(check_cameras(scene));
  const std::vector<ViewNumbers> numbers = number_views(scene);
  ByteWriter out;
  out.text("MVSI");
  out.value<std::uint32_t>(kVersion);
  out.value<std::uint32_t>(0);
  append_count(out, scene.cameras.size());
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    append_platform(out, scene, i);
  }
  append_count(out, scene.registered_count());
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].cam_from_world) {
      append_image(out, scene.views[i], i, numbers[i], image_folder);
    }
  }
  append_vertices(out, scene, numbers);
  append_count(out, 0);                                // lines
  append_count(out, 0);                                // their normals
  append_count(out, 0);                                // their colours
  append_row_major(out, Eigen::Matrix4d::Identity());  // relative from absolute coordinates
  append_row_major(out, Eigen::Matrix3d::Identity());  // bounding box: none
  append_row_major(out, Eigen::Matrix<double, 6, 1>::Zero());
  return std::move(out).take();
}

}  // namespace trigmesh
