#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace trigmesh::rig {

/// What a camera of the USB video class (UVC 1.0, bulk transfers) tells of itself: one size and
/// rate in two formats.
struct UvcCameraModel {
  std::uint16_t width_px = 320;
  std::uint16_t height_px = 240;
  std::uint32_t interval_100ns = 1'000'000;
};

inline constexpr std::uint8_t kStreamEndpoint = 1;
inline constexpr std::uint8_t kStreamInterface = 1;
inline constexpr std::uint8_t kMjpgFormat = 1;
inline constexpr std::uint8_t kYuyvFormat = 2;
/// Length of the block in which host and camera agree on a stream (UVC 1.0, 4.3.1.1).
inline constexpr std::size_t kProbeBytes = 26;
/// Bytes of picture data and header that the camera sends in one transfer.
inline constexpr std::uint32_t kMostPayloadBytes = 16'384;

[[nodiscard]] std::vector<std::uint8_t> device_descriptor();
[[nodiscard]] std::vector<std::uint8_t> configuration_descriptor(const UvcCameraModel& model);
/// Text `index` of the device; empty: it has no such text.
[[nodiscard]] std::vector<std::uint8_t> string_descriptor(unsigned index);

/// The camera's answer to what the host proposes for a stream: the format as wished, the rest as it
/// is.
[[nodiscard]] std::vector<std::uint8_t> settle_probe(const UvcCameraModel& model,
                                                     std::uint8_t wished_format);

}  // namespace trigmesh::rig
