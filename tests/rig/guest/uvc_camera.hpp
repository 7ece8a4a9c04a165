#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "tests/rig/guest/usbip_port.hpp"
#include "tests/rig/guest/uvc_descriptors.hpp"

namespace trigmesh::rig {

/// The pictures of a camera, in both formats.
struct UvcPictures {
  std::vector<std::vector<std::uint8_t>> mjpg;
  std::vector<std::vector<std::uint8_t>> yuyv;
};

/// A USB camera as the kernel sees it from the cable: answers control requests, and sends its
/// pictures over and over in the format and at the rate agreed, as long as the host takes them.
/// Thread-compatible.
class UvcCamera {
 public:
  using Time = std::chrono::steady_clock::time_point;

  UvcCamera(UvcCameraModel model, UvcPictures pictures, UsbipPort port);

  /// One request of the kernel.
  [[nodiscard]] Result<> take_request();

  /// Sends what is due at `now` as far as the host asks for it.
  [[nodiscard]] Result<> send_due(Time now);

  /// When there is something to send; Time::max() while the host asks for nothing.
  [[nodiscard]] Time next_due() const;

  [[nodiscard]] int fd() const { return port_.fd(); }

 private:
  /// Empty: the camera does not know the request.
  [[nodiscard]] std::vector<std::uint8_t> standard_answer(const UsbRequest& request) const;
  [[nodiscard]] std::vector<std::uint8_t> stream_answer(const UsbRequest& request) const;
  [[nodiscard]] Result<> control(const UsbRequest& request);
  [[nodiscard]] Result<> take_data(const UsbRequest& request);
  [[nodiscard]] Result<> take_back(const UsbRequest& request);
  [[nodiscard]] Result<> send_payload(const UsbRequest& request);
  [[nodiscard]] std::span<const std::uint8_t> picture() const;

  UvcCameraModel model_;
  UvcPictures pictures_;
  UsbipPort port_;
  std::vector<std::uint8_t> probe_;
  std::deque<UsbRequest> waiting_;  ///< transfers of pictures that the host asks for
  bool is_streaming_ = false;
  std::size_t picture_number_ = 0;
  std::size_t sent_bytes_ = 0;  ///< of this picture
  Time due_;
};

}  // namespace trigmesh::rig
