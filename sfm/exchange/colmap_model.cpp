#include "sfm/exchange/colmap_model.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr std::array kModels{
    ColmapModel{0, "SIMPLE_PINHOLE", 3, CameraModel::kPinhole},
    ColmapModel{1, "PINHOLE", 4, CameraModel::kPinhole},
    ColmapModel{2, "SIMPLE_RADIAL", 4, CameraModel::kRadial},
    ColmapModel{3, "RADIAL", 5, CameraModel::kRadial},
    ColmapModel{4, "OPENCV", 8, CameraModel::kBrownConrady},
    ColmapModel{5, "OPENCV_FISHEYE", 8, CameraModel::kKannalaBrandt},
    ColmapModel{6, "FULL_OPENCV", 12, std::nullopt},
    ColmapModel{7, "FOV", 5, std::nullopt},
    ColmapModel{8, "SIMPLE_RADIAL_FISHEYE", 4, std::nullopt},
    ColmapModel{9, "RADIAL_FISHEYE", 5, std::nullopt},
    ColmapModel{10, "THIN_PRISM_FISHEYE", 12, std::nullopt},
};

/// COLMAP's models with one focal length; the others begin with fx fy.
bool has_single_focal(const ColmapModel& model) {
  return model.name == "SIMPLE_PINHOLE" || model.name == "SIMPLE_RADIAL" || model.name == "RADIAL";
}

template <typename Entry, typename Id>
Result<> sort_by_id(std::vector<Entry>& entries, Id id, std::string_view kind) {
  std::ranges::stable_sort(entries, {}, id);
  const auto twice = std::ranges::adjacent_find(entries, {}, id);
  if (twice != entries.end()) {
    return fail(ErrorCode::kCorruptData, "{} {} stands twice in the model", kind, id(*twice));
  }
  return {};
}

/// Position of the entry with this identifier in a sorted table, or nothing.
template <typename Entry, typename Id, typename Value>
std::optional<std::size_t> find_id(const std::vector<Entry>& entries, Id id, Value value) {
  const auto found = std::ranges::lower_bound(entries, value, {}, id);
  if (found == entries.end() || id(*found) != value) {
    return std::nullopt;
  }
  return static_cast<std::size_t>(found - entries.begin());
}

constexpr auto kCameraId = [](const ColmapCamera& camera) { return camera.first; };
constexpr auto kImageId = [](const ColmapImage& image) { return image.id; };
constexpr auto kPointId = [](const ColmapPoint& point) { return point.id; };

/// The observations of a point, sorted, each checked against its image; still with several of one
/// image.
Result<std::vector<Observation>> checked_track(const ColmapTables& tables,
                                               const ColmapPoint& point) {
  std::vector<Observation> track;
  track.reserve(point.track.size());
  for (const auto& [image_id, keypoint] : point.track) {
    const auto position = find_id(tables.images, kImageId, image_id);
    if (!position) {
      return fail(ErrorCode::kCorruptData,
                  "point {} is seen by image {}, which is not in the model",
                  point.id,
                  image_id);
    }
    const ColmapImage& image = tables.images[*position];
    if (keypoint >= image.point_ids.size() || image.point_ids[keypoint] != point.id) {
      return fail(ErrorCode::kCorruptData,
                  "point {} is seen by keypoint {} of image {}, which does not know of it",
                  point.id,
                  keypoint,
                  image_id);
    }
    track.push_back({id_of<ViewId>(*position), FeatureIndex{keypoint}});
  }
  std::ranges::sort(track);
  track.erase(std::unique(track.begin(), track.end()), track.end());
  return track;
}

void keep_first_of_each_view(std::vector<Observation>& track) {
  const auto same_view = [](const Observation& a, const Observation& b) {
    return a.view == b.view;
  };
  track.erase(std::unique(track.begin(), track.end(), same_view), track.end());
}

/// Every keypoint that names a point must name one that exists; returns how many do.
Result<std::size_t> count_claims(const ColmapTables& tables) {
  std::size_t claims = 0;
  for (const ColmapImage& image : tables.images) {
    for (std::size_t i = 0; i < image.point_ids.size(); ++i) {
      const std::uint64_t point = image.point_ids[i];
      if (point == kNoColmapPoint) {
        continue;
      }
      if (!find_id(tables.points, kPointId, point)) {
        return fail(ErrorCode::kCorruptData,
                    "keypoint {} of image {} sees point {}, which is not in the model",
                    i,
                    image.id,
                    point);
      }
      ++claims;
    }
  }
  return claims;
}

Result<> add_views(const ColmapTables& tables, Scene& scene) {
  scene.views.reserve(tables.images.size());
  for (const ColmapImage& image : tables.images) {
    const auto camera = find_id(tables.cameras, kCameraId, image.camera_id);
    if (!camera) {
      return fail(ErrorCode::kCorruptData,
                  "image {} was taken by camera {}, which is not in the model",
                  image.id,
                  image.camera_id);
    }
    View view;
    view.name = image.name;
    view.camera = id_of<CameraId>(*camera);
    view.cam_from_world = image.cam_from_world;
    view.keypoints_px = image.keypoints_px;
    view.landmarks.assign(image.keypoints_px.size(), kNoLandmark);
    scene.views.push_back(std::move(view));
  }
  return {};
}

Result<> add_landmarks(const ColmapTables& tables, Scene& scene) {
  TM_ASSIGN_OR_RETURN(const std::size_t claims, count_claims(tables));
  std::size_t tracked = 0;
  scene.landmarks.reserve(tables.points.size());
  for (const ColmapPoint& point : tables.points) {
    TM_ASSIGN_OR_RETURN(std::vector<Observation> track, checked_track(tables, point));
    tracked += track.size();
    keep_first_of_each_view(track);
    if (track.size() < 2) {
      continue;
    }
    const auto id = id_of<LandmarkId>(scene.landmarks.size());
    for (const Observation& observation : track) {
      scene.views[index(observation.view)].landmarks[index(observation.feature)] = id;
    }
    scene.landmarks.push_back(
        {point.position_in_world, point.color_rgb, point.error_px, std::move(track)});
  }
  if (claims != tracked) {
    return fail(ErrorCode::kCorruptData,
                "{} keypoints name a point, but the tracks of the points hold {}",
                claims,
                tracked);
  }
  return {};
}

}  // namespace

const ColmapModel* find_colmap_model(std::string_view name) {
  const auto* found = std::ranges::find(kModels, name, &ColmapModel::name);
  return found == kModels.end() ? nullptr : found;
}

const ColmapModel* find_colmap_model(std::int32_t id) {
  const auto* found = std::ranges::find(kModels, id, &ColmapModel::id);
  return found == kModels.end() ? nullptr : found;
}

ColmapParameters colmap_from_camera(const Camera& camera) {
  const double cx = camera.cx_px + kColmapPixelShift;
  const double cy = camera.cy_px + kColmapPixelShift;
  const auto& d = camera.distortion;
  switch (camera.model) {
    case CameraModel::kPinhole:
      return {find_colmap_model("PINHOLE"), {camera.fx_px, camera.fy_px, cx, cy}};
    case CameraModel::kRadial:
      if (camera.fx_px == camera.fy_px) {
        return {find_colmap_model("RADIAL"), {camera.fx_px, cx, cy, d[0], d[1]}};
      }
      return {find_colmap_model("OPENCV"), {camera.fx_px, camera.fy_px, cx, cy, d[0], d[1]}};
    case CameraModel::kBrownConrady:
      return {find_colmap_model("OPENCV"),
              {camera.fx_px, camera.fy_px, cx, cy, d[0], d[1], d[2], d[3]}};
    case CameraModel::kKannalaBrandt:
      return {find_colmap_model("OPENCV_FISHEYE"),
              {camera.fx_px, camera.fy_px, cx, cy, d[0], d[1], d[2], d[3]}};
  }
  TM_CHECK(false);
}

Result<Camera> camera_from_colmap(const ColmapModel& model,
                                  std::uint64_t width_px,
                                  std::uint64_t height_px,
                                  std::span<const double> parameters) {
  TM_CHECK(parameters.size() == model.parameter_count);
  constexpr std::uint64_t kLargestSide = 1'000'000;
  if (!model.model) {
    return fail(ErrorCode::kUnsupported,
                "camera model {} is not supported (SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, "
                "OPENCV and OPENCV_FISHEYE are)",
                model.name);
  }
  if (width_px > kLargestSide || height_px > kLargestSide) {
    return fail(ErrorCode::kCorruptData, "no image is {}x{} pixels", width_px, height_px);
  }
  Camera camera;
  camera.model = *model.model;
  camera.width_px = static_cast<int>(width_px);
  camera.height_px = static_cast<int>(height_px);
  const std::size_t focal_count = has_single_focal(model) ? 1 : 2;
  camera.fx_px = parameters[0];
  camera.fy_px = parameters[focal_count - 1];
  camera.cx_px = parameters[focal_count] - kColmapPixelShift;
  camera.cy_px = parameters[focal_count + 1] - kColmapPixelShift;
  std::ranges::copy(parameters.subspan(focal_count + 2), camera.distortion.begin());
  if (Result<> valid = camera.validate(); !valid) {
    return fail(ErrorCode::kCorruptData, "{}", valid.error().message);
  }
  return camera;
}

Result<Rigid3> pose_from_colmap(const std::array<double, 4>& qw_qx_qy_qz,
                                const Eigen::Vector3d& translation) {
  const auto& [w, x, y, z] = qw_qx_qy_qz;
  Eigen::Quaterniond rotation(w, x, y, z);
  const double norm = rotation.norm();
  if (!(norm > 1e-9 && norm < 1e9) || !translation.allFinite()) {
    return fail(ErrorCode::kCorruptData, "the pose is no rigid motion");
  }
  constexpr double kRounding = 1e-15;
  if (std::abs(norm - 1.0) > kRounding) {
    rotation.coeffs() /= norm;
  }
  return Rigid3{rotation, translation};
}

std::optional<Eigen::Vector2f> keypoint_from_colmap(double x, double y) {
  const Eigen::Vector2f keypoint(static_cast<float>(x - kColmapPixelShift),
                                 static_cast<float>(y - kColmapPixelShift));
  if (!keypoint.allFinite()) {
    return std::nullopt;
  }
  return keypoint;
}

Result<Scene> scene_from_colmap(ColmapTables tables) {
  TM_RETURN_IF_ERROR(sort_by_id(tables.cameras, kCameraId, "camera"));
  TM_RETURN_IF_ERROR(sort_by_id(tables.images, kImageId, "image"));
  TM_RETURN_IF_ERROR(sort_by_id(tables.points, kPointId, "point"));
  Scene scene;
  for (const auto& [id, camera] : tables.cameras) {
    scene.cameras.push_back(camera);
  }
  TM_RETURN_IF_ERROR(add_views(tables, scene));
  TM_RETURN_IF_ERROR(add_landmarks(tables, scene));
  TM_RETURN_IF_ERROR(scene.validate());
  return scene;
}

Result<> check_colmap_name(std::string_view name) {
  if (name.empty() || name.find_first_of(std::string_view("\n\r\0", 3)) != name.npos) {
    return fail(ErrorCode::kUnsupported,
                "an image name is empty or holds a line break: rename the file");
  }
  return {};
}

}  // namespace trigmesh
