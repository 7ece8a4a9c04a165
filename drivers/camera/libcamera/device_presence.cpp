#include "drivers/camera/libcamera/device_presence.hpp"

#include <algorithm>
#include <optional>

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <fmt/core.h>

namespace trigmesh {
namespace {

/// Of the entry itself: a device that comes back under its number is a new entry.
std::optional<ino_t> inode_of(const std::string& path) {
  struct stat status {};

  return ::lstat(path.c_str(), &status) == 0 ? std::optional(status.st_ino) : std::nullopt;
}

}  // namespace

DevicePresence DevicePresence::of_devices(const std::vector<dev_t>& numbers) {
  std::vector<std::string> paths;
  for (const dev_t number : numbers) {
    paths.push_back(fmt::format("/sys/dev/char/{}:{}", ::major(number), ::minor(number)));
  }
  return DevicePresence(paths);
}

DevicePresence::DevicePresence(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (const std::optional<ino_t> inode = inode_of(path)) {
      marks_.push_back({path, *inode});
    }
  }
}

bool DevicePresence::is_lost() const {
  return std::any_of(marks_.begin(), marks_.end(), [](const Mark& mark) {
    return inode_of(mark.path) != mark.inode;
  });
}

}  // namespace trigmesh
