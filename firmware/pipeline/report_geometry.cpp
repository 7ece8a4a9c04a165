#include "firmware/pipeline/report_geometry.hpp"

#include <bit>
#include <cstdint>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <nlohmann/json.hpp>

#include "firmware/pipeline/base64.hpp"

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kDropped = 0xFFFFFFFFU;

void append_float(Bytes& bytes, double value) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  for (unsigned shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>((bits >> shift) & 0xFFU));
  }
}

void append_leb128(Bytes& bytes, std::uint32_t value) {
  while (value >= 0x80U) {
    bytes.push_back(static_cast<std::uint8_t>((value & 0x7FU) | 0x80U));
    value >>= 7U;
  }
  bytes.push_back(static_cast<std::uint8_t>(value));
}

/// For each landmark its position among the kept ones, or kDropped; `kept` of them remain, evenly
/// spaced.
std::vector<std::uint32_t> thin(std::size_t count, std::size_t kept) {
  std::vector<std::uint32_t> position(count, kDropped);
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if ((i + 1) * kept / count > i * kept / count) {
      position[i] = next++;
    }
  }
  return position;
}

/// The blobs that all components share, filled in order.
struct Blobs {
  Bytes positions;
  Bytes colors;
  Bytes visibility;
};

void append_points(Blobs& blobs, const Scene& scene, const std::vector<std::uint32_t>& position) {
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    if (position[i] == kDropped) {
      continue;
    }
    const Landmark& landmark = scene.landmarks[i];
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      append_float(blobs.positions, landmark.position_in_world[axis]);
    }
    blobs.colors.insert(blobs.colors.end(), landmark.color_rgb.begin(), landmark.color_rgb.end());
  }
}

/// Per view the kept landmarks that it sees, ascending.
std::vector<std::vector<std::uint32_t>> seen_points(const Scene& scene,
                                                    const std::vector<std::uint32_t>& position) {
  std::vector<std::vector<std::uint32_t>> seen(scene.views.size());
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    if (position[i] == kDropped) {
      continue;
    }
    for (const Observation& observation : scene.landmarks[i].track) {
      seen[index(observation.view)].push_back(position[i]);
    }
  }
  return seen;
}

void append_visibility(Blobs& blobs, const std::vector<std::uint32_t>& seen) {
  append_leb128(blobs.visibility, static_cast<std::uint32_t>(seen.size()));
  std::uint32_t previous = 0;
  for (const std::uint32_t point : seen) {
    append_leb128(blobs.visibility, point - previous);
    previous = point;
  }
}

Json pose_to_json(const Rigid3& cam_from_world) {
  const Eigen::Vector3d center = camera_center(cam_from_world);
  const Eigen::Quaterniond world_from_cam = cam_from_world.rotation.conjugate();
  return {
      {"center", {center.x(), center.y(), center.z()}},
      {"rotation",
       {world_from_cam.x(), world_from_cam.y(), world_from_cam.z(), world_from_cam.w()}},
  };
}

Json camera_position(const ReconstructionReport& report, std::size_t component, std::size_t group) {
  for (std::size_t i = 0; i < report.cameras.size(); ++i) {
    if (report.cameras[i].component == component && report.cameras[i].group == group) {
      return i;
    }
  }
  return nullptr;
}

using RowByName = std::unordered_map<std::string_view, std::size_t>;

Json component_to_json(const ReconstructionReport& report,
                       const RowByName& rows,
                       std::span<const Scene> components,
                       std::size_t component,
                       std::size_t kept,
                       Blobs& blobs) {
  const Scene& scene = components[component];
  const std::vector<std::uint32_t> position = thin(scene.landmarks.size(), kept);
  const std::vector<std::vector<std::uint32_t>> seen = seen_points(scene, position);
  append_points(blobs, scene, position);
  Json poses = Json::array();
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    const auto row = rows.find(view.name);
    if (!view.cam_from_world || row == rows.end()) {
      continue;
    }
    Json pose = {{"image", row->second},
                 {"camera", camera_position(report, component, index(view.camera))}};
    pose.update(pose_to_json(*view.cam_from_world));
    poses.push_back(std::move(pose));
    append_visibility(blobs, seen[i]);
  }
  return {{"points", kept}, {"points_total", scene.landmarks.size()}, {"poses", std::move(poses)}};
}

}  // namespace

std::string render_report_geometry(const ReconstructionReport& report,
                                   std::span<const Scene> components,
                                   std::size_t point_limit) {
  RowByName rows;
  for (std::size_t i = 0; i < report.images.size(); ++i) {
    rows.emplace(report.images[i].name, i);
  }
  std::size_t total = 0;
  for (const Scene& scene : components) {
    total += scene.landmarks.size();
  }
  Blobs blobs;
  Json list = Json::array();
  for (std::size_t c = 0; c < components.size(); ++c) {
    const std::size_t count = components[c].landmarks.size();
    const std::size_t kept = total <= point_limit ? count : count * point_limit / total;
    list.push_back(component_to_json(report, rows, components, c, kept, blobs));
  }
  const Json document = {
      {"point_limit", point_limit},
      {"components", std::move(list)},
      {"positions", base64(blobs.positions)},
      {"colors", base64(blobs.colors)},
      {"visibility", base64(blobs.visibility)},
  };
  return document.dump();
}

}  // namespace trigmesh
