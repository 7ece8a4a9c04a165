#pragma once

#include <string>
#include <vector>

#include <sys/types.h>

namespace trigmesh {

/// Whether the devices of a camera are still those that were there when this was made. libcamera
/// tells of cameras that go only for USB; another one is merely silent, and stopping it would end
/// the process in one of libcamera's own checks (seen with 0.0.3). Takes no memory from the heap
/// once it is made.
class DevicePresence {
 public:
  /// Of nothing: never lost.
  DevicePresence() = default;

  /// By device numbers, as the kernel lists them in /sys/dev/char.
  [[nodiscard]] static DevicePresence of_devices(const std::vector<dev_t>& numbers);

  /// By paths of that kind.
  explicit DevicePresence(const std::vector<std::string>& paths);

  /// Whether one of them is gone, or another one has its place.
  [[nodiscard]] bool is_lost() const;

 private:
  struct Mark {
    std::string path;
    ino_t inode = 0;
  };

  std::vector<Mark> marks_;
};

}  // namespace trigmesh
