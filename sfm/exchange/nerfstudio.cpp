#include "sfm/exchange/nerfstudio.hpp"

#include <nlohmann/json.hpp>

#include "firmware/base/check.hpp"
#include "sfm/exchange/colmap_model.hpp"
#include "sfm/exchange/image_paths.hpp"

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;

/// Every key of the lens model is written, zero or not, so that no default of a reader can step in.
void add_intrinsics(const Camera& camera, Json& json) {
  const auto& d = camera.distortion;
  json["camera_model"] = camera.model == CameraModel::kKannalaBrandt ? "OPENCV_FISHEYE" : "OPENCV";
  json["w"] = camera.width_px;
  json["h"] = camera.height_px;
  json["fl_x"] = camera.fx_px;
  json["fl_y"] = camera.fy_px;
  json["cx"] = camera.cx_px + kColmapPixelShift;
  json["cy"] = camera.cy_px + kColmapPixelShift;
  json["k1"] = d[0];
  json["k2"] = d[1];
  if (camera.model == CameraModel::kKannalaBrandt) {
    json["k3"] = d[2];
    json["k4"] = d[3];
  } else {
    json["p1"] = d[2];  // zero for the pinhole and radial models
    json["p2"] = d[3];
  }
}

Json transform_matrix(const Rigid3& cam_from_world) {
  Eigen::Matrix4d world_from_cam = Eigen::Matrix4d::Identity();
  world_from_cam.topRows<3>() = cam_from_world.inverse().matrix();
  world_from_cam.col(1) = -world_from_cam.col(1);  // y up
  world_from_cam.col(2) = -world_from_cam.col(2);  // z back
  Json rows = Json::array();
  for (Eigen::Index row = 0; row < 4; ++row) {
    rows.push_back({world_from_cam(row, 0),
                    world_from_cam(row, 1),
                    world_from_cam(row, 2),
                    world_from_cam(row, 3)});
  }
  return rows;
}

}  // namespace

Result<std::string> write_nerfstudio(const Scene& scene,
                                     std::string_view image_folder,
                                     std::string_view ply_name) {
  Json json;
  const bool shared_intrinsics = scene.cameras.size() == 1;
  if (shared_intrinsics) {
    add_intrinsics(scene.cameras.front(), json);
  }
  json["ply_file_path"] = ply_name;
  Json frames = Json::array();
  for (const View& view : scene.views) {
    if (!view.cam_from_world) {
      continue;
    }
    Json frame;
    frame["file_path"] = image_path(image_folder, view.name);
    if (!shared_intrinsics) {
      add_intrinsics(scene.cameras[index(view.camera)], frame);
    }
    frame["transform_matrix"] = transform_matrix(*view.cam_from_world);
    frames.push_back(std::move(frame));
  }
  json["frames"] = std::move(frames);
  try {
    return json.dump(1) + "\n";
  } catch (const Json::exception&) {
    return fail(ErrorCode::kUnsupported,
                "an image name is not UTF-8, which transforms.json cannot hold: rename the file");
  }
}

}  // namespace trigmesh
