#include "drivers/camera/v4l2/kernel.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace trigmesh {

namespace fs = std::filesystem;

int LinuxKernel::open(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  return fd >= 0 ? fd : -errno;
}

void LinuxKernel::close(int fd) {
  (void)::close(fd);  // nothing can be done about a failure here
}

int LinuxKernel::ioctl(int fd, unsigned long request, void* argument) {
  while (true) {
    const int result = ::ioctl(fd, request, argument);
    if (result >= 0 || errno != EINTR) {
      return result >= 0 ? result : -errno;
    }
  }
}

MappedMemory LinuxKernel::map(int fd, std::size_t size, std::int64_t offset) {
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, fd, static_cast<off_t>(offset));
  if (address == MAP_FAILED) {
    return {nullptr, errno};
  }
  return {static_cast<std::uint8_t*>(address), 0};
}

void LinuxKernel::unmap(std::uint8_t* address, std::size_t size) {
  (void)::munmap(address, size);
}

int LinuxKernel::poll(std::span<pollfd> descriptors, int timeout_ms) {
  const int ready = ::poll(descriptors.data(), descriptors.size(), timeout_ms);
  return ready >= 0 ? ready : -errno;
}

std::vector<std::string> LinuxKernel::list(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    names.push_back(entry->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string LinuxKernel::resolve(const std::string& path) {
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  return error ? std::string() : real.string();
}

}  // namespace trigmesh
