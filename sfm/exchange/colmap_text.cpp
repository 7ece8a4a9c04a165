#include "sfm/exchange/colmap_text.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include <fmt/compile.h>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "sfm/exchange/text_reader.hpp"

namespace trigmesh {
namespace {

using Buffer = fmt::memory_buffer;

void append(Buffer& out, std::string_view text) {
  out.append(text.data(), text.data() + text.size());
}

void append_real(Buffer& out, double value) {
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{}"), value);
}

/// How many decimals tell this float from its neighbours: the smallest k with 10^-k <= half a unit
/// in its last place.
int decimals_of(float value) {
  constexpr double kLog10Of2 = 0.30102999566398120;
  constexpr int kMantissaBits = 24;
  return static_cast<int>(std::ceil((kMantissaBits - std::ilogb(value)) * kLog10Of2));
}

/// value + 0.5 with the fewest decimals (10 times as fine as needed at most) from which reading
/// gives the same float.
void append_pixel(Buffer& out, float value) {
  static constexpr std::array<double, 10> kPowers{1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
  const double shifted = static_cast<double>(value) + kColmapPixelShift;
  const float magnitude = std::abs(value);
  const int decimals = magnitude >= 0.0625F && magnitude < 1e6F ? decimals_of(value) : -1;
  if (decimals < 1 || decimals >= std::ssize(kPowers)) {
    append_real(out, shifted);
    return;
  }
  const auto power = static_cast<std::uint64_t>(kPowers[static_cast<std::size_t>(decimals)]);
  const auto scaled = static_cast<std::uint64_t>(
      std::llround(std::abs(shifted) * kPowers[static_cast<std::size_t>(decimals)]));
  if (shifted < 0.0) {
    out.push_back('-');
  }
  fmt::format_to(std::back_inserter(out), FMT_COMPILE("{}"), scaled / power);
  std::uint64_t fraction = scaled % power;
  if (fraction == 0) {
    return;
  }
  std::array<char, 10> digits{};
  digits[0] = '.';
  std::size_t length = 1;
  for (int i = decimals; i > 0; --i, fraction /= 10) {
    digits[static_cast<std::size_t>(i)] = static_cast<char>('0' + fraction % 10);
    length = length == 1 && fraction % 10 != 0 ? static_cast<std::size_t>(i) + 1 : length;
  }
  out.append(digits.data(), digits.data() + length);
}

std::string write_cameras(const Scene& scene) {
  Buffer out;
  append(out,
         "# Cameras, one a line: CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n"
         "# The centre of the first pixel is (0.5, 0.5).\n");
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const Camera& camera = scene.cameras[i];
    const ColmapParameters parameters = colmap_from_camera(camera);
    fmt::format_to(std::back_inserter(out),
                   "{} {} {} {}",
                   i + 1,
                   parameters.model->name,
                   camera.width_px,
                   camera.height_px);
    for (const double value : parameters.used()) {
      out.push_back(' ');
      append_real(out, value);
    }
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

void append_keypoints(Buffer& out, const View& view) {
  for (std::size_t i = 0; i < view.keypoints_px.size(); ++i) {
    if (i > 0) {
      out.push_back(' ');
    }
    append_pixel(out, view.keypoints_px[i].x());
    out.push_back(' ');
    append_pixel(out, view.keypoints_px[i].y());
    if (view.landmarks[i] == kNoLandmark) {
      append(out, " -1");
    } else {
      fmt::format_to(std::back_inserter(out), FMT_COMPILE(" {}"), index(view.landmarks[i]) + 1);
    }
  }
}

std::string write_images(const Scene& scene) {
  Buffer out;
  append(out,
         "# Images, two lines each:\n"
         "#   IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME (world to camera)\n"
         "#   POINTS2D[] as (X Y POINT3D_ID), -1 for none\n");
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    if (!view.cam_from_world) {
      continue;
    }
    const Eigen::Quaterniond& q = view.cam_from_world->rotation;
    const Eigen::Vector3d& t = view.cam_from_world->translation;
    fmt::format_to(std::back_inserter(out), "{}", i + 1);
    for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) {
      out.push_back(' ');
      append_real(out, value);
    }
    fmt::format_to(std::back_inserter(out), " {} {}\n", index(view.camera) + 1, view.name);
    append_keypoints(out, view);
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

std::string write_points(const Scene& scene) {
  Buffer out;
  append(out,
         "# Points, one a line: POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID POINT2D_IDX)\n");
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    const Landmark& landmark = scene.landmarks[i];
    const auto& [red, green, blue] = landmark.color_rgb;
    fmt::format_to(std::back_inserter(out), FMT_COMPILE("{}"), i + 1);
    for (const double value : landmark.position_in_world) {
      out.push_back(' ');
      append_real(out, value);
    }
    fmt::format_to(std::back_inserter(out), FMT_COMPILE(" {} {} {} "), red, green, blue);
    append_real(out, landmark.error_px);
    for (const Observation& observation : landmark.track) {
      fmt::format_to(std::back_inserter(out),
                     FMT_COMPILE(" {} {}"),
                     index(observation.view) + 1,
                     index(observation.feature));
    }
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

/// Reads the first line of an image; `reader` stands on it.
ColmapImage read_image_line(TextReader& reader) {
  ColmapImage image;
  image.id = reader.integer<std::uint32_t>("an image id");
  std::array<double, 4> quaternion{};
  for (double& value : quaternion) {
    value = reader.real("a quaternion");
  }
  Eigen::Vector3d translation;
  for (double& value : translation) {
    value = reader.real("a translation");
  }
  image.camera_id = reader.integer<std::uint32_t>("a camera id");
  image.name = reader.rest();
  if (reader.ok() && image.name.empty()) {
    reader.reject("the image name is missing");
  }
  if (reader.ok()) {
    if (const Result<Rigid3> pose = pose_from_colmap(quaternion, translation); pose) {
      image.cam_from_world = *pose;
    } else {
      reader.reject(pose.error().message);
    }
  }
  return image;
}

void read_keypoints(TextReader& reader, ColmapImage& image) {
  while (reader.ok() && !reader.at_line_end()) {
    const double x = reader.real("a pixel");
    const double y = reader.real("a pixel");
    const auto point = reader.integer<std::int64_t>("a point id");
    const auto keypoint = keypoint_from_colmap(x, y);
    if (!keypoint || point < -1) {
      reader.reject(keypoint ? "a point id is negative" : "a keypoint is out of range");
      return;
    }
    image.keypoints_px.push_back(*keypoint);
    image.point_ids.push_back(point == -1 ? kNoColmapPoint : static_cast<std::uint64_t>(point));
  }
}

Result<std::vector<ColmapImage>> read_images(std::string_view text) {
  TextReader reader(text, "images.txt");
  std::vector<ColmapImage> images;
  while (reader.next_record()) {
    ColmapImage image = read_image_line(reader);
    if (reader.next_line()) {  // may be empty; at the very end it may be missing
      read_keypoints(reader, image);
    }
    images.push_back(std::move(image));
  }
  TM_RETURN_IF_ERROR(reader.status());
  return images;
}

Result<std::vector<ColmapPoint>> read_points(std::string_view text) {
  TextReader reader(text, "points3D.txt");
  std::vector<ColmapPoint> points;
  while (reader.next_record()) {
    ColmapPoint point;
    point.id = reader.integer<std::uint64_t>("a point id");
    for (double& value : point.position_in_world) {
      value = reader.real("a coordinate");
    }
    for (std::uint8_t& value : point.color_rgb) {
      value = reader.integer<std::uint8_t>("a colour (0 to 255)");
    }
    point.error_px = reader.real("an error");
    while (reader.ok() && !reader.at_line_end()) {
      const auto image = reader.integer<std::uint32_t>("an image id");
      const auto keypoint = reader.integer<std::uint32_t>("a keypoint index");
      point.track.emplace_back(image, keypoint);
    }
    points.push_back(std::move(point));
  }
  TM_RETURN_IF_ERROR(reader.status());
  return points;
}

}  // namespace

Result<ColmapText> write_colmap_text(const Scene& scene) {
  for (const View& view : scene.views) {
    TM_RETURN_IF_ERROR(check_colmap_name(view.name));
  }
  return ColmapText{write_cameras(scene), write_images(scene), write_points(scene)};
}

Result<Scene> read_colmap_text(const ColmapText& text) {
  ColmapTables tables;
  TM_ASSIGN_OR_RETURN(tables.cameras, read_colmap_cameras(text.cameras));
  TM_ASSIGN_OR_RETURN(tables.images, read_images(text.images));
  TM_ASSIGN_OR_RETURN(tables.points, read_points(text.points));
  return scene_from_colmap(std::move(tables));
}

Result<std::vector<ColmapCamera>> read_colmap_cameras(std::string_view text) {
  TextReader reader(text, "cameras.txt");
  std::vector<ColmapCamera> cameras;
  while (reader.next_record()) {
    const auto id = reader.integer<std::uint32_t>("a camera id");
    const std::string_view name = reader.word("the camera model");
    const ColmapModel* model = find_colmap_model(name);
    if (reader.ok() && model == nullptr) {
      reader.reject("the camera model is unknown", ErrorCode::kUnsupported);
    }
    const auto width = reader.integer<std::uint64_t>("a width");
    const auto height = reader.integer<std::uint64_t>("a height");
    std::vector<double> parameters(reader.ok() ? model->parameter_count : 0);
    for (double& value : parameters) {
      value = reader.real("a camera parameter");
    }
    if (reader.ok() && !reader.at_line_end()) {
      reader.reject(fmt::format("{} has {} parameters, here are more", name, parameters.size()));
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

Result<std::vector<NamedPose>> read_colmap_poses(std::string_view text) {
  TextReader reader(text, "images.txt");
  std::vector<NamedPose> poses;
  while (reader.next_record()) {
    ColmapImage image = read_image_line(reader);
    poses.push_back({std::move(image.name), image.cam_from_world});
    reader.next_line();
  }
  TM_RETURN_IF_ERROR(reader.status());
  return poses;
}

}  // namespace trigmesh
