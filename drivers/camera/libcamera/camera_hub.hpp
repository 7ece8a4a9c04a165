#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/camera/libcamera/device_presence.hpp"
#include "drivers/camera/libcamera/frame_exchange.hpp"
#include "drivers/device/device_fault.hpp"

namespace libcamera {
class Camera;
}  // namespace libcamera

namespace trigmesh {

/// A camera that libcamera knows.
struct LibcameraCamera {
  /// libcamera's id: where the camera sits on the board. The same after a restart and a replug.
  std::string stable_name;
  std::string model;  ///< of the sensor, "imx477"
};

/// A share in the process's one connection to libcamera, which allows no second one: it is made
/// with the first hub and ends with the last. It follows cameras that come and go, so whoever waits
/// for a camera keeps its hub. Everything of libcamera that was got through a hub goes before it.
/// Thread-safe.
class CameraHub {
 public:
  /// kIo and the like: libcamera does not start.
  [[nodiscard]] static DeviceResult<std::unique_ptr<CameraHub>> open();

  ~CameraHub();
  CameraHub(const CameraHub&) = delete;
  CameraHub& operator=(const CameraHub&) = delete;
  CameraHub(CameraHub&&) = delete;
  CameraHub& operator=(CameraHub&&) = delete;

  /// The camera of a stable name, or the first one for an empty name. kNotFound says which there
  /// are, and what to look at. Shared because libcamera shares its cameras.
  [[nodiscard]] DeviceResult<LibcameraCamera> find(std::string_view name);

  /// libcamera's object of a camera that find() gave; kNotFound when it went meanwhile. Shared
  /// because libcamera shares its cameras.
  [[nodiscard]] DeviceResult<std::shared_ptr<libcamera::Camera>> get(std::string_view stable_name);

  /// Those that are there now, in libcamera's order.
  [[nodiscard]] std::vector<LibcameraCamera> list();

  /// What tells whether the devices of a camera are still there.
  [[nodiscard]] DevicePresence presence_of(const std::shared_ptr<libcamera::Camera>& camera);

  /// From now on the exchange is told when the camera is unplugged, and the camera's completed
  /// requests go nowhere from then on. Weak: a watch keeps nothing alive.
  void watch(const libcamera::Camera& camera, const std::weak_ptr<FrameExchange>& exchange);

 private:
  class Manager;
  struct Process;

  explicit CameraHub(Manager& manager) : manager_(manager) {}

  [[nodiscard]] static Process& process();

  Manager& manager_;
};

/// All cameras that libcamera knows now. It knows those that it may open and has a pipeline for.
[[nodiscard]] DeviceResult<std::vector<LibcameraCamera>> list_libcamera_cameras();

/// "front", "front (imx477), ...": what is said of a camera to a person.
[[nodiscard]] std::string describe(const LibcameraCamera& camera);

}  // namespace trigmesh
