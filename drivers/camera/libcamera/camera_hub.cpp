#include "drivers/camera/libcamera/camera_hub.hpp"

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <system_error>
#include <utility>

#include <sys/stat.h>

#include <libcamera/camera.h>
#include <libcamera/camera_manager.h>
#include <libcamera/property_ids.h>
#include <libcamera/version.h>

namespace trigmesh {

/// libcamera's manager, and who wants to know of cameras that go.
class CameraHub::Manager {
 public:
  Manager() { manager_.cameraRemoved.connect(this, &Manager::on_removed); }

  /// Its thread has ended when stop() returns: nothing calls on_removed any more.
  ~Manager() { manager_.stop(); }

  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;
  Manager(Manager&&) = delete;
  Manager& operator=(Manager&&) = delete;

  [[nodiscard]] int start() { return manager_.start(); }

  [[nodiscard]] std::vector<std::shared_ptr<libcamera::Camera>> cameras() const {
    return manager_.cameras();
  }

  /// The numbers of its capture nodes.
  [[nodiscard]] std::vector<dev_t> devices_of(const std::shared_ptr<libcamera::Camera>& camera) {
    std::vector<dev_t> numbers;
#if LIBCAMERA_VERSION_MAJOR == 0 && LIBCAMERA_VERSION_MINOR == 0
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
      struct stat status {};

      if (::stat(entry.path().c_str(), &status) == 0 && S_ISCHR(status.st_mode) &&
          manager_.get(status.st_rdev) == camera) {
        numbers.push_back(status.st_rdev);
      }
    }
#else
    if (const auto told = camera->properties().get(libcamera::properties::SystemDevices)) {
      for (const std::int64_t number : *told) {
        numbers.push_back(static_cast<dev_t>(number));
      }
    }
#endif
    return numbers;
  }

  void watch(const libcamera::Camera& camera, const std::weak_ptr<FrameExchange>& exchange) {
    const std::lock_guard lock(mutex_);
    std::erase_if(watches_, [](const Watch& watch) { return watch.exchange.expired(); });
    watches_.push_back({&camera, exchange});
  }

 private:
  struct Watch {
    const libcamera::Camera* camera = nullptr;
    std::weak_ptr<FrameExchange> exchange;
  };

  /// On libcamera's thread, where requests complete too: the one place in which the signal of a
  /// camera that went can be cut without a request completing meanwhile.
  void on_removed(std::shared_ptr<libcamera::Camera> camera) {
    camera->requestCompleted.disconnect();
    const std::lock_guard lock(mutex_);
    for (const Watch& watch : watches_) {
      const std::shared_ptr<FrameExchange> exchange = watch.exchange.lock();
      if (watch.camera == camera.get() && exchange != nullptr) {
        exchange->on_gone();
      }
    }
  }

  std::mutex mutex_;
  std::vector<Watch> watches_;  ///< guarded by mutex_
  libcamera::CameraManager manager_;
};

/// The manager and how many hubs share it. Counted by hand and not by a shared_ptr, because a new
/// manager may not begin before the old one has ended.
struct CameraHub::Process {
  std::mutex mutex;
  std::unique_ptr<Manager> manager;
  int hub_count = 0;
};

CameraHub::Process& CameraHub::process() {
  // Never destroyed: the end of a manager whose camera went without its knowledge ends the process.
  static Process& process = *new Process;
  return process;
}

namespace {

LibcameraCamera summary_of(const libcamera::Camera& camera) {
  const auto model = camera.properties().get(libcamera::properties::Model);
  return {.stable_name = camera.id(), .model = model ? std::string(*model) : std::string()};
}

std::string names_of(const std::vector<LibcameraCamera>& cameras) {
  std::string text;
  for (const LibcameraCamera& camera : cameras) {
    text += fmt::format("{}{}", text.empty() ? "" : ", ", describe(camera));
  }
  return text.empty() ? "none" : text;
}

}  // namespace

DeviceResult<std::unique_ptr<CameraHub>> CameraHub::open() {
  Process& shared = process();
  const std::lock_guard lock(shared.mutex);
  if (shared.manager == nullptr) {
    auto manager = std::make_unique<Manager>();
    if (const int status = manager->start(); status < 0) {
      return tl::unexpected<DeviceFault>(fault_of_errno(-status, "cannot start", "libcamera"));
    }
    shared.manager = std::move(manager);
  }
  ++shared.hub_count;
  return std::unique_ptr<CameraHub>(new CameraHub(*shared.manager));
}

CameraHub::~CameraHub() {
  Process& shared = process();
  const std::lock_guard lock(shared.mutex);
  if (--shared.hub_count == 0) {
    shared.manager.reset();
  }
}

std::vector<LibcameraCamera> CameraHub::list() {
  std::vector<LibcameraCamera> cameras;
  for (const std::shared_ptr<libcamera::Camera>& camera : manager_.cameras()) {
    cameras.push_back(summary_of(*camera));
  }
  return cameras;
}

DeviceResult<std::shared_ptr<libcamera::Camera>> CameraHub::get(std::string_view stable_name) {
  for (const std::shared_ptr<libcamera::Camera>& camera : manager_.cameras()) {
    if (camera->id() == stable_name) {
      return camera;
    }
  }
  return device_fault(FaultKind::kNotFound, "libcamera knows camera {} no more", stable_name);
}

DeviceResult<LibcameraCamera> CameraHub::find(std::string_view name) {
  const std::vector<LibcameraCamera> cameras = list();
  for (const LibcameraCamera& camera : cameras) {
    if (name.empty() || camera.stable_name == name) {
      return camera;
    }
  }
  return device_fault(
      FaultKind::kNotFound,
      "libcamera knows no camera {}; those that it knows: {}; check the cable, that "
      "package libcamera-ipa is installed, and that /dev/media* may be opened",
      name.empty() ? "at all" : name,
      names_of(cameras));
}

DevicePresence CameraHub::presence_of(const std::shared_ptr<libcamera::Camera>& camera) {
  return DevicePresence::of_devices(manager_.devices_of(camera));
}

void CameraHub::watch(const libcamera::Camera& camera,
                      const std::weak_ptr<FrameExchange>& exchange) {
  manager_.watch(camera, exchange);
}

DeviceResult<std::vector<LibcameraCamera>> list_libcamera_cameras() {
  TM_ASSIGN_OR_FAULT(const std::unique_ptr<CameraHub> hub, CameraHub::open());
  return hub->list();
}

std::string describe(const LibcameraCamera& camera) {
  return camera.model.empty() ? camera.stable_name
                              : fmt::format("{} ({})", camera.stable_name, camera.model);
}

}  // namespace trigmesh
