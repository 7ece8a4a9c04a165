#include "firmware/devices/device_list.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>

#include <fmt/format.h>

#include "drivers/camera/v4l2/camera_list.hpp"
#include "firmware/base/unique_fd.hpp"
#ifdef TRIGMESH_WITH_LIBCAMERA
#include "drivers/camera/libcamera/camera_hub.hpp"
#endif

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

DeviceInfo describe_chip(const fs::path& node) {
  DeviceInfo device{"gpio chip", node.filename().string(), "", node.string()};
  const UniqueFd fd(::open(node.c_str(), O_RDONLY | O_CLOEXEC));
  gpiochip_info info{};
  if (!fd.valid() || ::ioctl(fd.get(), GPIO_GET_CHIPINFO_IOCTL, &info) != 0) {
    device.note += fmt::format(": {}", std::generic_category().message(errno));
    return device;
  }
  device.model = std::string(info.label, ::strnlen(info.label, sizeof(info.label)));
  device.note += fmt::format(", {} lines", info.lines);
  return device;
}

}  // namespace

std::vector<DeviceInfo> find_gpio_chips(const fs::path& folder) {
  std::vector<DeviceInfo> chips;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().filename().string().starts_with("gpiochip")) {
      chips.push_back(describe_chip(entry->path()));
    }
  }
  std::sort(chips.begin(), chips.end(), [](const DeviceInfo& a, const DeviceInfo& b) {
    return a.stable_name < b.stable_name;
  });
  return chips;
}

std::vector<DeviceInfo> find_devices() {
  std::vector<DeviceInfo> devices;
  LinuxKernel kernel;
  for (const CameraNode& camera : list_cameras(kernel)) {
    devices.push_back({"camera",
                       camera.stable_name,
                       camera.model,
                       fmt::format("v4l2, {}, driver {}", camera.path, camera.driver)});
  }
#ifdef TRIGMESH_WITH_LIBCAMERA
  if (const auto cameras = list_libcamera_cameras()) {
    for (const LibcameraCamera& camera : *cameras) {
      devices.push_back({"camera", camera.stable_name, camera.model, "libcamera"});
    }
  }
#endif
  const std::vector<DeviceInfo> chips = find_gpio_chips("/dev");
  devices.insert(devices.end(), chips.begin(), chips.end());
  return devices;
}

}  // namespace trigmesh
