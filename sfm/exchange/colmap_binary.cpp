#include "sfm/exchange/colmap_binary.hpp"

#include <array>
#include <cstdint>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/exchange/byte_io.hpp"
#include "sfm/exchange/colmap_model.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kKeypointBytes = 2 * sizeof(double) + sizeof(std::uint64_t);
constexpr std::size_t kTrackEntryBytes = 2 * sizeof(std::uint32_t);
/// The smallest entries, which bound how many there can be.
constexpr std::size_t kCameraBytes = 4 + 4 + 8 + 8 + 3 * sizeof(double);
constexpr std::size_t kImageBytes = 4 + 7 * sizeof(double) + 4 + 1 + 8;
constexpr std::size_t kPointBytes = 8 + 3 * sizeof(double) + 3 + sizeof(double) + 8;

std::string write_cameras(const Scene& scene) {
  ByteWriter out;
  out.value<std::uint64_t>(scene.cameras.size());
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const Camera& camera = scene.cameras[i];
    const ColmapParameters parameters = colmap_from_camera(camera);
    out.value<std::uint32_t>(static_cast<std::uint32_t>(i + 1));
    out.value<std::int32_t>(parameters.model->id);
    out.value<std::uint64_t>(static_cast<std::uint64_t>(camera.width_px));
    out.value<std::uint64_t>(static_cast<std::uint64_t>(camera.height_px));
    for (const double value : parameters.used()) {
      out.value<double>(value);
    }
  }
  return std::move(out).take();
}

void append_image(ByteWriter& out, const View& view, std::size_t position) {
  const Eigen::Quaterniond& q = view.cam_from_world->rotation;
  const Eigen::Vector3d& t = view.cam_from_world->translation;
  out.value<std::uint32_t>(static_cast<std::uint32_t>(position + 1));
  for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) {
    out.value<double>(value);
  }
  out.value<std::uint32_t>(static_cast<std::uint32_t>(index(view.camera) + 1));
  out.text(view.name);
  out.value<char>('\0');
  out.value<std::uint64_t>(view.keypoints_px.size());
  for (std::size_t i = 0; i < view.keypoints_px.size(); ++i) {
    const LandmarkId landmark = view.landmarks[i];
    out.value<double>(static_cast<double>(view.keypoints_px[i].x()) + kColmapPixelShift);
    out.value<double>(static_cast<double>(view.keypoints_px[i].y()) + kColmapPixelShift);
    out.value<std::uint64_t>(landmark == kNoLandmark ? kNoColmapPoint : index(landmark) + 1);
  }
}

std::string write_images(const Scene& scene) {
  ByteWriter out;
  out.value<std::uint64_t>(scene.registered_count());
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].cam_from_world) {
      append_image(out, scene.views[i], i);
    }
  }
  return std::move(out).take();
}

std::string write_points(const Scene& scene) {
  ByteWriter out;
  out.value<std::uint64_t>(scene.landmarks.size());
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    const Landmark& landmark = scene.landmarks[i];
    out.value<std::uint64_t>(i + 1);
    for (const double value : landmark.position_in_world) {
      out.value<double>(value);
    }
    for (const std::uint8_t value : landmark.color_rgb) {
      out.value<std::uint8_t>(value);
    }
    out.value<double>(landmark.error_px);
    out.value<std::uint64_t>(landmark.track.size());
    for (const Observation& observation : landmark.track) {
      out.value<std::uint32_t>(static_cast<std::uint32_t>(index(observation.view) + 1));
      out.value<std::uint32_t>(static_cast<std::uint32_t>(index(observation.feature)));
    }
  }
  return std::move(out).take();
}

Result<std::vector<ColmapCamera>> read_cameras(std::string_view bytes) {
  ByteReader reader(bytes, "cameras.bin");
  const std::size_t count = reader.count(kCameraBytes);
  std::vector<ColmapCamera> cameras;
  cameras.reserve(count);
  for (std::size_t i = 0; i < count && reader.ok(); ++i) {
    const auto id = reader.value<std::uint32_t>();
    const ColmapModel* model = find_colmap_model(reader.value<std::int32_t>());
    const auto width = reader.value<std::uint64_t>();
    const auto height = reader.value<std::uint64_t>();
    if (reader.ok() && model == nullptr) {
      reader.reject("the camera model is unknown", ErrorCode::kUnsupported);
      break;
    }
    std::vector<double> parameters(reader.ok() ? model->parameter_count : 0);
    for (double& value : parameters) {
      value = reader.value<double>();
    }
    if (!reader.ok()) {
      break;
    }
    if (Result<Camera> camera = camera_from_colmap(*model, width, height, parameters); camera) {
      cameras.emplace_back(id, *camera);
    } else {
      reader.reject(camera.error().message, camera.error().code);
    }
  }
  TM_RETURN_IF_ERROR(reader.status());
  return cameras;
}

/// Reads an image up to its keypoints.
ColmapImage read_image_head(ByteReader& reader) {
  ColmapImage image;
  image.id = reader.value<std::uint32_t>();
  std::array<double, 4> quaternion{};
  for (double& value : quaternion) {
    value = reader.value<double>();
  }
  Eigen::Vector3d translation;
  for (double& value : translation) {
    value = reader.value<double>();
  }
  image.camera_id = reader.value<std::uint32_t>();
  image.name = reader.zero_terminated();
  if (reader.ok()) {
    if (const Result<Rigid3> pose = pose_from_colmap(quaternion, translation); pose) {
      image.cam_from_world = *pose;
    } else {
      reader.reject(pose.error().message);
    }
  }
  return image;
}

void read_keypoints(ByteReader& reader, ColmapImage& image) {
  const std::size_t count = reader.count(kKeypointBytes);
  image.keypoints_px.reserve(count);
  image.point_ids.reserve(count);
  for (std::size_t i = 0; i < count && reader.ok(); ++i) {
    const auto x = reader.value<double>();
    const auto y = reader.value<double>();
    image.point_ids.push_back(reader.value<std::uint64_t>());
    const auto keypoint = keypoint_from_colmap(x, y);
    if (!keypoint) {
      reader.reject("a keypoint is out of range");
    }
    image.keypoints_px.push_back(keypoint.value_or(Eigen::Vector2f::Zero()));
  }
}

Result<std::vector<ColmapImage>> read_images(std::string_view bytes) {
  ByteReader reader(bytes, "images.bin");
  const std::size_t count = reader.count(kImageBytes);
  std::vector<ColmapImage> images;
  images.reserve(count);
  for (std::size_t i = 0; i < count && reader.ok(); ++i) {
    ColmapImage image = read_image_head(reader);
    read_keypoints(reader, image);
    images.push_back(std::move(image));
  }
  TM_RETURN_IF_ERROR(reader.status());
  return images;
}

Result<std::vector<ColmapPoint>> read_points(std::string_view bytes) {
  ByteReader reader(bytes, "points3D.bin");
  const std::size_t count = reader.count(kPointBytes);
  std::vector<ColmapPoint> points;
  points.reserve(count);
  for (std::size_t i = 0; i < count && reader.ok(); ++i) {
    ColmapPoint point;
    point.id = reader.value<std::uint64_t>();
    for (double& value : point.position_in_world) {
      value = reader.value<double>();
    }
    for (std::uint8_t& value : point.color_rgb) {
      value = reader.value<std::uint8_t>();
    }
    point.error_px = reader.value<double>();
    point.track.resize(reader.count(kTrackEntryBytes));
    for (auto& [image, keypoint] : point.track) {
      image = reader.value<std::uint32_t>();
      keypoint = reader.value<std::uint32_t>();
    }
    points.push_back(std::move(point));
  }
  TM_RETURN_IF_ERROR(reader.status());
  return points;
}

}  // namespace

Result<ColmapBinary> write_colmap_binary(const Scene& scene) {
  for (const View& view : scene.views) {
    TM_RETURN_IF_ERROR(check_colmap_name(view.name));
  }
  return ColmapBinary{write_cameras(scene), write_images(scene), write_points(scene)};
}

Result<Scene> read_colmap_binary(const ColmapBinary& bytes) {
  ColmapTables tables;
  TM_ASSIGN_OR_RETURN(tables.cameras, read_cameras(bytes.cameras));
  TM_ASSIGN_OR_RETURN(tables.images, read_images(bytes.images));
  TM_ASSIGN_OR_RETURN(tables.points, read_points(bytes.points));
  return scene_from_colmap(std::move(tables));
}

Result<std::vector<NamedPose>> read_colmap_binary_poses(std::string_view images) {
  ByteReader reader(images, "images.bin");
  const std::size_t count = reader.count(kImageBytes);
  std::vector<NamedPose> poses;
  poses.reserve(count);
  for (std::size_t i = 0; i < count && reader.ok(); ++i) {
    ColmapImage image = read_image_head(reader);
    reader.skip(reader.count(kKeypointBytes) * kKeypointBytes);
    poses.push_back({std::move(image.name), image.cam_from_world});
  }
  TM_RETURN_IF_ERROR(reader.status());
  return poses;
}

}  // namespace trigmesh
