#include "tests/rig/guest/usbip_port.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include <sys/socket.h>
#include <unistd.h>

#include <arpa/inet.h>

#include "firmware/base/check.hpp"

namespace trigmesh::rig {
namespace {

constexpr const char* kAttach = "/sys/devices/platform/vhci_hcd.0/attach";

// Commands of the protocol (Documentation/usb/usbip_protocol of the kernel); all numbers are big
// endian, a header is 48 bytes.
constexpr std::uint32_t kSubmit = 1;
constexpr std::uint32_t kUnlink = 2;
constexpr std::uint32_t kSubmitAnswer = 3;
constexpr std::uint32_t kUnlinkAnswer = 4;
constexpr std::size_t kHeaderWords = 12;
using Header = std::array<std::uint32_t, kHeaderWords>;

constexpr std::uint32_t kHighSpeed = 3;
constexpr std::uint32_t kDeviceId = 1U << 16U | 2U;
constexpr std::uint32_t kMostBytes = 16U << 20U;

std::span<std::uint8_t> bytes_of(Header& header) {
  return {reinterpret_cast<std::uint8_t*>(header.data()), sizeof(header)};
}

}  // namespace

Result<UsbipPort> UsbipPort::plug_in() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return fail(ErrorCode::kIo, "cannot make a socket pair: {}", std::strerror(errno));
  }
  UsbipPort port(ends[0]);
  const UniqueFd kernels_end(ends[1]);
  std::ofstream attach(kAttach);
  attach << fmt::format("0 {} {} {}", kernels_end.get(), kDeviceId, kHighSpeed) << std::flush;
  if (!attach) {
    return fail(
        ErrorCode::kIo, "cannot plug in at {}: is vhci-hcd loaded, and port 0 free?", kAttach);
  }
  return port;
}

UsbipPort::UsbipPort(UsbipPort&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

UsbipPort::~UsbipPort() {
  if (fd_ >= 0) {
    (void)::close(fd_);
  }
}

Result<UsbRequest> UsbipPort::next() const {
  Header header{};
  TM_RETURN_IF_ERROR(read_all(bytes_of(header)));
  UsbRequest request;
  request.sequence = ntohl(header[1]);
  request.is_in = ntohl(header[3]) != 0;
  request.endpoint = ntohl(header[4]);
  const std::uint32_t command = ntohl(header[0]);
  if (command == kUnlink) {
    request.takes_back = ntohl(header[5]);
    return request;
  }
  request.length_bytes = ntohl(header[6]);
  if (command != kSubmit || request.length_bytes > kMostBytes) {
    return fail(ErrorCode::kCorruptData,
                "the kernel sent command {} of {} bytes",
                command,
                request.length_bytes);
  }
  std::memcpy(request.setup.data(), &header[10], request.setup.size());
  if (!request.is_in) {
    request.data.resize(request.length_bytes);
    TM_RETURN_IF_ERROR(read_all(request.data));
  }
  return request;
}

Result<> UsbipPort::answer(const UsbRequest& request,
                           int status,
                           std::span<const std::uint8_t> data,
                           std::uint32_t taken_bytes) const {
  Header header{};
  header[0] = htonl(kSubmitAnswer);
  header[1] = htonl(request.sequence);
  header[5] = htonl(static_cast<std::uint32_t>(status));
  header[6] = htonl(request.is_in ? static_cast<std::uint32_t>(data.size()) : taken_bytes);
  TM_RETURN_IF_ERROR(write_all(bytes_of(header)));
  return request.is_in ? write_all(data) : Result<>();
}

Result<> UsbipPort::answer_taken_back(const UsbRequest& request, bool was_waiting) const {
  Header header{};
  header[0] = htonl(kUnlinkAnswer);
  header[1] = htonl(request.sequence);
  header[5] = htonl(static_cast<std::uint32_t>(was_waiting ? -ECONNRESET : 0));
  return write_all(bytes_of(header));
}

Result<> UsbipPort::read_all(std::span<std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::read(fd_, bytes.data(), bytes.size());
    if (count <= 0) {
      if (count < 0 && errno == EINTR) {
        continue;
      }
      return fail(ErrorCode::kIo, "the kernel let the device go");
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return {};
}

Result<> UsbipPort::write_all(std::span<const std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count < 0) {
      if (errno == EINTR) {
        continue;
      }
      return fail(ErrorCode::kIo, "the kernel let the device go: {}", std::strerror(errno));
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return {};
}

}  // namespace trigmesh::rig
