#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/base/unique_fd.hpp"

namespace trigmesh::rig {

/// What the kernel asks of a USB device, as its host controller driver vhci_hcd passes it on.
struct UsbRequest {
  std::uint32_t sequence = 0;
  std::uint32_t endpoint = 0;
  bool is_in = false;                       ///< from the device to the host
  std::uint32_t length_bytes = 0;           ///< of the transfer
  std::array<std::uint8_t, 8> setup{};      ///< of a control transfer
  std::vector<std::uint8_t> data;           ///< from the host
  std::optional<std::uint32_t> takes_back;  ///< the request with this number is not wanted any more
};

/// One port of the kernel's virtual host controller with a device plugged in: requests come,
/// answers go. The device is unplugged when the port goes.
class UsbipPort {
 public:
  /// Plugs a high-speed device into the first port. kIo: there is no vhci_hcd, or not for us.
  [[nodiscard]] static Result<UsbipPort> plug_in();

  /// Readable when a request waits.
  [[nodiscard]] int fd() const { return fd_; }

  /// The next request; waits for it. kIo: the kernel let the device go.
  [[nodiscard]] Result<UsbRequest> next() const;

  /// The answer to a transfer: `status` 0 or a negative errno. `data` goes to the host, for
  /// requests from the device; else `taken_bytes` tells how much of the host's data was taken.
  [[nodiscard]] Result<> answer(const UsbRequest& request,
                                int status,
                                std::span<const std::uint8_t> data,
                                std::uint32_t taken_bytes = 0) const;

  /// The answer to a request that takes another back.
  [[nodiscard]] Result<> answer_taken_back(const UsbRequest& request, bool was_waiting) const;

  UsbipPort(UsbipPort&& other) noexcept;
  UsbipPort& operator=(UsbipPort&&) = delete;
  UsbipPort(const UsbipPort&) = delete;
  UsbipPort& operator=(const UsbipPort&) = delete;
  ~UsbipPort();

 private:
  explicit UsbipPort(int fd) : fd_(fd) {}

  [[nodiscard]] Result<> read_all(std::span<std::uint8_t> bytes) const;
  [[nodiscard]] Result<> write_all(std::span<const std::uint8_t> bytes) const;

  int fd_;
};

}  // namespace trigmesh::rig
