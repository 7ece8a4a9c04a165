#include "tests/rig/guest/uvc_descriptors.hpp"

#include <array>
#include <initializer_list>
#include <span>

#include <linux/usb/ch9.h>
#include <linux/usb/video.h>

namespace trigmesh::rig {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Appends numbers in the order and width in which a descriptor has them.
class Descriptor {
 public:
  Descriptor& u8(std::initializer_list<unsigned> values) {
    for (const unsigned value : values) {
      bytes_.push_back(static_cast<std::uint8_t>(value));
    }
    return *this;
  }

  Descriptor& u16(unsigned value) { return u8({value & 0xFFU, value >> 8U & 0xFFU}); }

  Descriptor& u32(std::uint32_t value) { return u16(value & 0xFFFFU).u16(value >> 16U); }

  Descriptor& append(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) {
      bytes_.push_back(byte);
    }
    return *this;
  }

  /// With its own length as the first byte.
  [[nodiscard]] Bytes sized() const {
    Descriptor whole;
    whole.u8({static_cast<unsigned>(bytes_.size() + 1)}).append(bytes_);
    return whole.bytes_;
  }

  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

std::uint32_t raw_bytes(const UvcCameraModel& model) {
  return std::uint32_t{2} * model.width_px * model.height_px;
}

Bytes frame_descriptor(const UvcCameraModel& model, unsigned subtype) {
  const auto bits = raw_bytes(model) * 8;
  const auto bits_per_second =
      static_cast<std::uint32_t>(std::uint64_t{bits} * 10'000'000 / model.interval_100ns);
  return Descriptor()
      .u8({USB_DT_CS_INTERFACE, subtype, 1, 0})
      .u16(model.width_px)
      .u16(model.height_px)
      .u32(bits_per_second)
      .u32(bits_per_second)
      .u32(raw_bytes(model))
      .u32(model.interval_100ns)
      .u8({1})  // one discrete interval
      .u32(model.interval_100ns)
      .sized();
}

Bytes formats(const UvcCameraModel& model) {
  Descriptor all;
  all.append(Descriptor()
                 .u8({USB_DT_CS_INTERFACE, UVC_VS_FORMAT_MJPEG, kMjpgFormat, 1, 1, 1, 0, 0, 0, 0})
                 .sized());
  all.append(frame_descriptor(model, UVC_VS_FRAME_MJPEG));
  // The code "YUY2", then the end that all codes of raw formats have (UVC 1.0, payload
  // uncompressed).
  constexpr std::array<std::uint8_t, 16> kYuy2 = {
      'Y', 'U', 'Y', '2', 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71};
  all.append(Descriptor()
                 .u8({USB_DT_CS_INTERFACE, UVC_VS_FORMAT_UNCOMPRESSED, kYuyvFormat, 1})
                 .append(kYuy2)
                 .u8({16, 1, 0, 0, 0, 0})
                 .sized());
  all.append(frame_descriptor(model, UVC_VS_FRAME_UNCOMPRESSED));
  return all.bytes();
}

/// A camera sensor that is joined to the USB stream, and nothing in between.
Bytes control_interface() {
  const Bytes camera = Descriptor()
                           .u8({USB_DT_CS_INTERFACE, UVC_VC_INPUT_TERMINAL, 1})
                           .u16(UVC_ITT_CAMERA)
                           .u8({0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0})
                           .sized();
  const Bytes stream = Descriptor()
                           .u8({USB_DT_CS_INTERFACE, UVC_VC_OUTPUT_TERMINAL, 2})
                           .u16(UVC_TT_STREAMING)
                           .u8({0, 1, 0})
                           .sized();
  constexpr unsigned kHeaderBytes = 13;
  constexpr std::uint32_t kClockHz = 48'000'000;
  Descriptor all;
  all.append(Descriptor()
                 .u8({USB_DT_INTERFACE, 0, 0, 0, USB_CLASS_VIDEO, UVC_SC_VIDEOCONTROL, 0, 0})
                 .sized());
  all.append(Descriptor()
                 .u8({USB_DT_CS_INTERFACE, UVC_VC_HEADER})
                 .u16(0x0100)
                 .u16(static_cast<unsigned>(kHeaderBytes + camera.size() + stream.size()))
                 .u32(kClockHz)
                 .u8({1, kStreamInterface})
                 .sized());
  all.append(camera).append(stream);
  return all.bytes();
}

Bytes stream_interface(const UvcCameraModel& model) {
  const Bytes pictures = formats(model);
  constexpr unsigned kHeaderBytes = 15;
  constexpr unsigned kEndpointAddress = USB_DIR_IN | kStreamEndpoint;
  Descriptor all;
  all.append(Descriptor()
                 .u8({USB_DT_INTERFACE,
                      kStreamInterface,
                      0,
                      1,
                      USB_CLASS_VIDEO,
                      UVC_SC_VIDEOSTREAMING,
                      0,
                      0})
                 .sized());
  all.append(Descriptor()
                 .u8({USB_DT_CS_INTERFACE, UVC_VS_INPUT_HEADER, 2})
                 .u16(static_cast<unsigned>(kHeaderBytes + pictures.size()))
                 .u8({kEndpointAddress, 0, 2, 0, 0, 0, 1, 0, 0})
                 .sized());
  all.append(pictures);
  all.append(Descriptor()
                 .u8({USB_DT_ENDPOINT, kEndpointAddress, USB_ENDPOINT_XFER_BULK})
                 .u16(512)
                 .u8({0})
                 .sized());
  return all.bytes();
}

}  // namespace

std::vector<std::uint8_t> device_descriptor() {
  constexpr unsigned kVendor = 0x1d6b;  // Linux Foundation
  constexpr unsigned kProduct = 0x0104;
  return Descriptor()
      .u8({USB_DT_DEVICE})
      .u16(0x0200)
      .u8({USB_CLASS_MISC, 2, 1, 64})
      .u16(kVendor)
      .u16(kProduct)
      .u16(0x0100)
      .u8({1, 2, 3, 1})
      .sized();
}

std::vector<std::uint8_t> configuration_descriptor(const UvcCameraModel& model) {
  const Bytes control = control_interface();
  const Bytes stream = stream_interface(model);
  const Bytes both =
      Descriptor().u8({USB_DT_INTERFACE_ASSOCIATION, 0, 2, USB_CLASS_VIDEO, 3, 0, 0}).sized();
  constexpr std::size_t kHeaderBytes = 9;
  Descriptor all;
  all.append(
      Descriptor()
          .u8({USB_DT_CONFIG})
          .u16(static_cast<unsigned>(kHeaderBytes + both.size() + control.size() + stream.size()))
          .u8({2, 1, 0, USB_CONFIG_ATT_ONE, 50})
          .sized());
  all.append(both).append(control).append(stream);
  return all.bytes();
}

std::vector<std::uint8_t> string_descriptor(unsigned index) {
  constexpr std::array<std::string_view, 3> kTexts = {"Trigmesh", "Rig camera", "0001"};
  Descriptor text;
  text.u8({USB_DT_STRING});
  if (index == 0) {
    return text.u16(0x0409).sized();  // English
  }
  if (index > kTexts.size()) {
    return {};
  }
  for (const char letter : kTexts[index - 1]) {
    text.u16(static_cast<unsigned char>(letter));
  }
  return text.sized();
}

std::vector<std::uint8_t> settle_probe(const UvcCameraModel& model, std::uint8_t wished_format) {
  const unsigned format = wished_format == kYuyvFormat ? kYuyvFormat : kMjpgFormat;
  return Descriptor()
      .u16(0)
      .u8({format, 1})
      .u32(model.interval_100ns)
      .u16(0)
      .u16(0)
      .u16(0)
      .u16(0)
      .u16(0)
      .u32(raw_bytes(model))
      .u32(kMostPayloadBytes)
      .bytes();
}

}  // namespace trigmesh::rig
