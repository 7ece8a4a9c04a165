#include "tests/integration/sample_report.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/report_html.hpp"
#include "sfm/exchange/glb.hpp"
#include "tests/support/textured_globe.hpp"

namespace trigmesh::test_support {
namespace {

constexpr int kViews = 14;
constexpr double kDistance = 3.2;
const Eigen::Vector3d kCenter(0.0, 0.0, 3.0);

Camera sample_camera() {
  return {.width_px = 480,
          .height_px = 360,
          .fx_px = 420,
          .fy_px = 420,
          .cx_px = 239.5,
          .cy_px = 179.5};
}

/// On a ring, looking at the globe; the first stands near the origin of the world.
Rigid3 sample_pose(int view) {
  const double turn = 2.0 * std::numbers::pi * view / kViews;
  const Eigen::Quaterniond world_from_ring(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()));
  const Eigen::Quaterniond ring_from_cam(Eigen::AngleAxisd(-0.35, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond world_from_cam = world_from_ring * ring_from_cam;
  const Eigen::Vector3d center = kCenter - kDistance * (world_from_cam * Eigen::Vector3d::UnitZ());
  return Rigid3{world_from_cam, center}.inverse();
}

std::array<std::uint8_t, 3> texel(const TexturedMesh& globe, const Eigen::Vector3d& normal) {
  const double latitude = std::asin(std::clamp(-normal.y(), -1.0, 1.0));
  const double longitude = std::atan2(normal.z(), normal.x());
  const cv::Mat& page = globe.pages[latitude >= 0.0 ? 0 : 1];
  const double u =
      (longitude < 0.0 ? longitude + 2.0 * std::numbers::pi : longitude) / (2.0 * std::numbers::pi);
  const double from_pole = 0.5 - latitude / std::numbers::pi;
  const double v = latitude >= 0.0 ? 2.0 * from_pole : 2.0 * from_pole - 1.0;
  const auto at = [&](double share) {
    return std::clamp(static_cast<int>(share * page.cols), 0, page.cols - 1);
  };
  const cv::Vec3b color = page.at<cv::Vec3b>(at(v), at(u));
  return {color[0], color[1], color[2]};
}

/// How far along a ray (direction with z = 1 in the camera) the unit globe begins.
std::optional<double> hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d to_center = origin - kCenter;
  const double a = direction.squaredNorm();
  const double b = to_center.dot(direction);
  const double discriminant = b * b - a * (to_center.squaredNorm() - 1.0);
  if (discriminant < 0.0) {
    return std::nullopt;
  }
  return (-b - std::sqrt(discriminant)) / a;
}

struct Shot {
  cv::Mat rgb;
  DepthMap map;
};

Shot shoot(const TexturedMesh& globe, const Camera& camera, const Rigid3& cam_from_world) {
  Shot shot;
  shot.rgb = cv::Mat(camera.height_px, camera.width_px, CV_8UC3, cv::Scalar(70, 80, 88));
  shot.map.camera = camera;
  shot.map.depth = cv::Mat::zeros(shot.rgb.size(), CV_32FC1);
  shot.map.confidence = cv::Mat::zeros(shot.rgb.size(), CV_8UC1);
  const Eigen::Vector3d origin = camera_center(cam_from_world);
  const Eigen::Quaterniond world_from_cam = cam_from_world.rotation.conjugate();
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const Eigen::Vector3d ray(
          (x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px, 1.0);
      const Eigen::Vector3d direction = world_from_cam * ray;
      const std::optional<double> depth = hit(origin, direction);
      if (!depth) {
        continue;
      }
      const Eigen::Vector3d normal = origin + *depth * direction - kCenter;
      const std::array<std::uint8_t, 3> color = texel(globe, normal);
      shot.rgb.at<cv::Vec3b>(y, x) = cv::Vec3b(color[0], color[1], color[2]);
      const double facing = -normal.dot(direction.normalized());
      if (facing > 0.15) {  // stereo loses grazing surfaces too
        shot.map.depth.at<float>(y, x) = static_cast<float>(*depth);
        shot.map.confidence.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(255.0 * facing);
      }
    }
  }
  return shot;
}

/// The vertices of the globe as points, each seen by the views it faces.
Scene sample_scene(const TexturedMesh& globe) {
  Scene scene;
  scene.cameras = {sample_camera()};
  for (int i = 0; i < kViews; ++i) {
    View view;
    view.name = "globe/frame_" + std::to_string(100 + i) + ".jpg";
    view.cam_from_world = sample_pose(i);
    scene.views.push_back(std::move(view));
  }
  for (std::size_t i = 0; i < globe.mesh.positions.size(); ++i) {
    Landmark landmark;
    landmark.position_in_world = globe.mesh.positions[i].cast<double>();
    const Eigen::Vector3d normal = globe.mesh.normals[i].cast<double>();
    landmark.color_rgb = texel(globe, normal);
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      View& view = scene.views[v];
      const Eigen::Vector3d to_camera =
          camera_center(*view.cam_from_world) - landmark.position_in_world;
      const std::optional<Eigen::Vector2d> pixel =
          project(scene.cameras[0], *view.cam_from_world * landmark.position_in_world);
      if (to_camera.normalized().dot(normal) < 0.3 || !pixel) {
        continue;
      }
      landmark.track.push_back(
          {.view = id_of<ViewId>(v), .feature = id_of<FeatureIndex>(view.keypoints_px.size())});
      view.keypoints_px.push_back(pixel->cast<float>());
      view.landmarks.push_back(id_of<LandmarkId>(scene.landmarks.size()));
    }
    scene.landmarks.push_back(std::move(landmark));
  }
  return scene;
}

void add_sections(ReportInput& input) {
  static const std::vector<ScaleSection> kScale{
      {.outcome = ScaleOutcome::kOk,
       .metres_per_unit = 0.4,
       .sd_ratio = 0.0013,
       .lengths = {{"marker 0", 0.1, 0.4, 0.001, 0.0005},
                   {"markers 0 and 1", 0.5, 0.3996, 0.002, 0.0}},
       .markers = {{0, SquareOutcome::kOk, 14, 13, 0.21}, {1, SquareOutcome::kOk, 9, 9, 0.18}},
       .z_is_up = true,
       .up_sd_deg = 0.12}};
  input.scale = kScale;
  input.dense = DenseSection{.views = 14,
                             .map_width_px = 480,
                             .map_height_px = 360,
                             .filled_ratio = 0.874,
                             .points = 412'345,
                             .mean_view_count = 5.3,
                             .lowered = {"Depth maps at half the size of the photographs, to stay "
                                         "below 1500 MB."}};
  input.surface = SurfaceSection{
      .vertices = 1106,
      .faces = 2208,
      .components = 1,
      .area = 12.54,
      .seen_ratio = 0.973,
      .holes_filled = 12,
      .holes_open = 3,
      .largest_holes = {
          {{0.1, 1.02, 3.05}, 2.31}, {{-0.4, 0.8, 2.4}, 0.52}, {{0.6, -0.7, 3.3}, 0.18}}};
  input.texture = TextureSection{.views_used = 13,
                                 .charts = 38,
                                 .pages = 2,
                                 .page_size_px = 256,
                                 .textured_ratio = 0.951,
                                 .held_out_views = 2,
                                 .psnr_db = 27.42,
                                 .ssim = 0.9134};
  input.finish = FinishSection{
      false,
      "Not ready: 4.9 % of the surface is open or seen too little, the largest place of it 3.1 %.",
      0.049,
      {{GapKind::kHole,
        {0.1, 1.02, 3.05},
        0.031,
        "globe/frame_103.jpg",
        2.0,
        -38.0,
        "a hole, 3.1 % of the surface: from where globe/frame_103.jpg was taken hold the camera "
        "lower, by about 40\u00b0"}}};
}

std::string page_with(const TexturedMesh& globe, const std::string& glb) {
  const Scene scene = sample_scene(globe);
  std::vector<ImageOutcome> images;
  for (const View& view : scene.views) {
    ImageOutcome outcome;
    outcome.name = view.name;
    outcome.features = view.keypoints_px.size();
    images.push_back(std::move(outcome));
  }
  images.emplace_back();
  images.back().name = "globe/frame_200.jpg";
  images.back().reason = RefusalReason::kNoOverlap;
  const std::span<const Scene> components(&scene, 1);
  ReportInput input;
  input.components = components;
  input.images = images;
  input.input_description = "folder globe, 15 photographs";
  add_sections(input);
  std::vector<DepthPicture> pictures;
  for (std::size_t i = 0; i < kSampleDepthPictures; ++i) {
    const View& view = scene.views[2 * i];
    const Shot shot = shoot(globe, scene.cameras[0], *view.cam_from_world);
    Result<DepthPicture> picture = make_depth_picture(view.name, shot.rgb, shot.map);
    TM_CHECK(picture.has_value());
    pictures.push_back(std::move(*picture));
  }
  ReportAttachments attachments;
  attachments.glb = glb;
  attachments.depth_pictures = pictures;
  return render_report_html(build_report(input), components, attachments);
}

}  // namespace

std::string sample_report_page() {
  const TexturedMesh globe = make_textured_globe();
  const Result<std::string> glb = write_glb(globe);
  TM_CHECK(glb.has_value());
  return page_with(globe, *glb);
}

std::string sample_report_page_without_mesh() {
  return page_with(make_textured_globe(), std::string(kReportPageGlbLimitBytes + 1, '\0'));
}

}  // namespace trigmesh::test_support
