#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <poll.h>

namespace trigmesh {

/// What mapping memory of a device brought.
struct MappedMemory {
  std::uint8_t* address = nullptr;
  int error = 0;  ///< errno, 0: mapped
};

/// The system calls that a V4L2 camera is made of, so that a test can be the kernel. Calls return
/// what the system call returns, or a negative errno. Thread-safe.
class Kernel {
 public:
  Kernel() = default;
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;
  Kernel(Kernel&&) = delete;
  Kernel& operator=(Kernel&&) = delete;
  virtual ~Kernel() = default;

  /// For reading and writing, not blocking, closed on exec. The descriptor, or a negative errno.
  [[nodiscard]] virtual int open(const std::string& path) = 0;
  virtual void close(int fd) = 0;

  /// `argument` is the structure of the request. Goes on after a signal.
  [[nodiscard]] virtual int ioctl(int fd, unsigned long request, void* argument) = 0;

  /// Shared, for reading.
  [[nodiscard]] virtual MappedMemory map(int fd, std::size_t size, std::int64_t offset) = 0;
  virtual void unmap(std::uint8_t* address, std::size_t size) = 0;

  /// poll(2): the number of ready descriptors, 0 after `timeout_ms`, -EINTR after a signal.
  [[nodiscard]] virtual int poll(std::span<pollfd> descriptors, int timeout_ms) = 0;

  /// Names in a folder, sorted; empty when there is no such folder.
  [[nodiscard]] virtual std::vector<std::string> list(const std::string& folder) = 0;

  /// The path without links; empty when nothing is there.
  [[nodiscard]] virtual std::string resolve(const std::string& path) = 0;
};

/// An open device, closed when it goes.
class KernelFd {
 public:
  KernelFd() = default;

  // Shared: frames that outlive their source still unmap through it.
  KernelFd(std::shared_ptr<Kernel> kernel, int fd) : kernel_(std::move(kernel)), fd_(fd) {}

  KernelFd(const KernelFd&) = delete;
  KernelFd& operator=(const KernelFd&) = delete;

  KernelFd(KernelFd&& other) noexcept
      : kernel_(std::move(other.kernel_)), fd_(std::exchange(other.fd_, -1)) {}

  KernelFd& operator=(KernelFd&& other) noexcept {
    if (this != &other) {
      close();
      kernel_ = std::move(other.kernel_);
      fd_ = std::exchange(other.fd_, -1);
    }
    return *this;
  }

  ~KernelFd() { close(); }

  [[nodiscard]] int get() const { return fd_; }

  [[nodiscard]] bool valid() const { return fd_ >= 0; }

  /// The request on this device; see Kernel::ioctl.
  [[nodiscard]] int ioctl(unsigned long request, void* argument) const {
    return kernel_->ioctl(fd_, request, argument);
  }

  [[nodiscard]] const std::shared_ptr<Kernel>& kernel() const { return kernel_; }

  void close() {
    if (fd_ >= 0) {
      kernel_->close(std::exchange(fd_, -1));
    }
  }

 private:
  std::shared_ptr<Kernel> kernel_;
  int fd_ = -1;
};

/// The real one.
class LinuxKernel final : public Kernel {
 public:
  [[nodiscard]] int open(const std::string& path) override;
  void close(int fd) override;
  [[nodiscard]] int ioctl(int fd, unsigned long request, void* argument) override;
  [[nodiscard]] MappedMemory map(int fd, std::size_t size, std::int64_t offset) override;
  void unmap(std::uint8_t* address, std::size_t size) override;
  [[nodiscard]] int poll(std::span<pollfd> descriptors, int timeout_ms) override;
  [[nodiscard]] std::vector<std::string> list(const std::string& folder) override;
  [[nodiscard]] std::string resolve(const std::string& path) override;
};

}  // namespace trigmesh
