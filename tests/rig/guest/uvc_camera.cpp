#include "tests/rig/guest/uvc_camera.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <linux/usb/ch9.h>
#include <linux/usb/video.h>

#include "firmware/base/check.hpp"

namespace trigmesh::rig {
namespace {

constexpr std::size_t kPayloadHeaderBytes = 2;

std::chrono::nanoseconds interval_of(const UvcCameraModel& model) {
  return std::chrono::nanoseconds(std::int64_t{100} * model.interval_100ns);
}

unsigned value_of(const UsbRequest& request) {
  return request.setup[2] | static_cast<unsigned>(request.setup[3]) << 8U;
}

std::size_t wanted_bytes(const UsbRequest& request) {
  return request.setup[6] | static_cast<std::size_t>(request.setup[7]) << 8U;
}

}  // namespace

UvcCamera::UvcCamera(UvcCameraModel model, UvcPictures pictures, UsbipPort port)
    : model_(model),
      pictures_(std::move(pictures)),
      port_(std::move(port)),
      probe_(settle_probe(model, kMjpgFormat)) {}

Result<> UvcCamera::take_request() {
  TM_ASSIGN_OR_RETURN(UsbRequest request, port_.next());
  if (request.takes_back) {
    return take_back(request);
  }
  if (request.endpoint == 0) {
    return control(request);
  }
  if (waiting_.empty() && is_streaming_ && due_ == Time()) {
    due_ = std::chrono::steady_clock::now();
  }
  waiting_.push_back(std::move(request));
  return {};
}

Result<> UvcCamera::take_back(const UsbRequest& request) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const UsbRequest& other) {
    return other.sequence == *request.takes_back;
  });
  const bool was_waiting = found != waiting_.end();
  if (was_waiting) {
    waiting_.erase(found);
  }
  return port_.answer_taken_back(request, was_waiting);
}

Result<> UvcCamera::control(const UsbRequest& request) {
  if (!request.is_in) {
    return take_data(request);
  }
  const bool is_standard = (request.setup[0] & USB_TYPE_MASK) == USB_TYPE_STANDARD;
  std::vector<std::uint8_t> data = is_standard ? standard_answer(request) : stream_answer(request);
  if (data.empty()) {
    return port_.answer(request, -EPIPE, {});
  }
  data.resize(std::min(data.size(), wanted_bytes(request)));
  return port_.answer(request, 0, data);
}

std::vector<std::uint8_t> UvcCamera::standard_answer(const UsbRequest& request) const {
  switch (request.setup[1]) {
    case USB_REQ_GET_STATUS:
      return {0, 0};
    case USB_REQ_GET_INTERFACE:
      return {0};
    case USB_REQ_GET_CONFIGURATION:
      return {1};
    case USB_REQ_GET_DESCRIPTOR:
      break;
    default:
      return {};
  }
  switch (value_of(request) >> 8U) {
    case USB_DT_DEVICE:
      return device_descriptor();
    case USB_DT_CONFIG:
      return configuration_descriptor(model_);
    case USB_DT_STRING:
      return string_descriptor(value_of(request) & 0xFFU);
    default:
      return {};
  }
}

std::vector<std::uint8_t> UvcCamera::stream_answer(const UsbRequest& request) const {
  const unsigned selector = value_of(request) >> 8U;
  const bool is_probe = selector == UVC_VS_PROBE_CONTROL || selector == UVC_VS_COMMIT_CONTROL;
  if (request.setup[4] != kStreamInterface || !is_probe) {
    return {};
  }
  switch (request.setup[1]) {
    case UVC_GET_INFO:
      return {3};  // may be read and set
    case UVC_GET_LEN:
      return {kProbeBytes, 0};
    default:
      return probe_;
  }
}

Result<> UvcCamera::take_data(const UsbRequest& request) {
  const bool is_class = (request.setup[0] & USB_TYPE_MASK) == USB_TYPE_CLASS;
  if (is_class) {
    if (request.setup[1] != UVC_SET_CUR || request.setup[4] != kStreamInterface ||
        request.data.size() < 3) {
      return port_.answer(request, -EPIPE, {});
    }
    probe_ = settle_probe(model_, request.data[2]);
    if (value_of(request) >> 8U == UVC_VS_COMMIT_CONTROL) {
      is_streaming_ = true;
      sent_bytes_ = 0;
      due_ = Time();
    }
  }
  return port_.answer(request, 0, {}, static_cast<std::uint32_t>(request.data.size()));
}

UvcCamera::Time UvcCamera::next_due() const {
  return is_streaming_ && !waiting_.empty() ? due_ : Time::max();
}

Result<> UvcCamera::send_due(Time now) {
  while (next_due() <= now) {
    const UsbRequest request = std::move(waiting_.front());
    waiting_.pop_front();
    TM_RETURN_IF_ERROR(send_payload(request));
    if (sent_bytes_ == picture().size()) {
      sent_bytes_ = 0;
      ++picture_number_;
      // A host that was away is not sent what it missed.
      due_ = std::max(due_ + interval_of(model_), now);
    }
  }
  return {};
}

Result<> UvcCamera::send_payload(const UsbRequest& request) {
  const std::span<const std::uint8_t> rest = picture().subspan(sent_bytes_);
  const std::size_t most = std::min(request.length_bytes, kMostPayloadBytes) - kPayloadHeaderBytes;
  const std::span<const std::uint8_t> part = rest.first(std::min(rest.size(), most));
  const bool is_last = part.size() == rest.size();
  unsigned flags = UVC_STREAM_EOH | (picture_number_ % 2 != 0 ? UVC_STREAM_FID : 0U);
  flags |= is_last ? UVC_STREAM_EOF : 0U;
  std::vector<std::uint8_t> payload = {kPayloadHeaderBytes, static_cast<std::uint8_t>(flags)};
  payload.insert(payload.end(), part.begin(), part.end());
  sent_bytes_ += part.size();
  return port_.answer(request, 0, payload);
}

std::span<const std::uint8_t> UvcCamera::picture() const {
  const auto& pictures = probe_[2] == kYuyvFormat ? pictures_.yuyv : pictures_.mjpg;
  return pictures[picture_number_ % pictures.size()];
}

}  // namespace trigmesh::rig
