#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/camera/v4l2/kernel.hpp"
#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// A video node that captures pictures.
struct CameraNode {
  /// What finds the same camera again after a restart or on another port of the numbering:
  /// the link below /dev/v4l/by-id, else the one below /dev/v4l/by-path, else "bus:" and the bus
  /// information of its driver.
  std::string stable_name;
  std::string path;    ///< /dev/videoN, now
  std::string driver;  ///< "uvcvideo"
  std::string model;   ///< as the camera calls itself
  std::string bus;     ///< "usb-0000:00:14.0-1"
};

/// All cameras that are there and may be opened, in the order of their node numbers. Nodes that
/// give no pictures through single-plane streaming (metadata, output, codecs) are left out.
[[nodiscard]] std::vector<CameraNode> list_cameras(Kernel& kernel);

/// The camera of a stable name or of a path below /dev; an empty name means the first one.
/// kNotFound says which there are.
[[nodiscard]] DeviceResult<CameraNode> find_camera(Kernel& kernel, std::string_view name);

}  // namespace trigmesh
