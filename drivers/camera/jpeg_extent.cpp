#include "drivers/camera/jpeg_extent.hpp"

#include <cstring>
#include <string_view>

namespace trigmesh {
namespace {

constexpr std::uint8_t kStartOfImage = 0xD8;
constexpr std::uint8_t kEndOfImage = 0xD9;
constexpr std::uint8_t kStartOfScan = 0xDA;

/// RST0 to RST7 and TEM stand alone: no length follows.
bool stands_alone(std::uint8_t marker) {
  return (marker >= 0xD0 && marker <= 0xD7) || marker == 0x01;
}

/// SOF0 to SOF15 without DHT, JPG and DAC, which share their range.
bool starts_frame(std::uint8_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

tl::unexpected<Error> broken(std::string_view why, std::size_t position) {
  return fail(ErrorCode::kCorruptData, "damaged JPEG: {} at byte {}", why, position);
}

int big_endian_16(std::span<const std::uint8_t> bytes, std::size_t position) {
  return bytes[position] * 256 + bytes[position + 1];
}

/// The first marker at or behind `position` that is neither a stuffed byte nor a restart: where
/// coded data ends. The size of `bytes` when there is none.
std::size_t skip_coded_data(std::span<const std::uint8_t> bytes, std::size_t position) {
  while (position + 1 < bytes.size()) {
    const void* found = std::memchr(bytes.data() + position, 0xFF, bytes.size() - 1 - position);
    if (found == nullptr) {
      break;
    }
    position = static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - bytes.data());
    const std::uint8_t next = bytes[position + 1];
    if (next != 0x00 && next != 0xFF && !stands_alone(next)) {
      return position;
    }
    position += next == 0xFF ? 1U : 2U;
  }
  return bytes.size();
}

}  // namespace

Result<JpegExtent> find_jpeg_extent(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2 || bytes[0] != 0xFF || bytes[1] != kStartOfImage) {
    return broken("it does not begin like one", 0);
  }
  JpegExtent extent;
  bool has_scan = false;
  std::size_t position = 2;
  while (position + 1 < bytes.size()) {
    if (bytes[position] != 0xFF) {
      return broken("no marker where one has to be", position);
    }
    const std::uint8_t marker = bytes[position + 1];
    position += marker == 0xFF ? 1U : 2U;
    if (marker == 0xFF || stands_alone(marker)) {
      continue;
    }
    if (marker == kEndOfImage) {
      if (!has_scan || extent.width_px == 0 || extent.height_px == 0) {
        return broken("it ends before its picture", position);
      }
      extent.size_bytes = position;
      return extent;
    }
    if (bytes.size() - position < 2) {
      break;
    }
    const auto length = static_cast<std::size_t>(big_endian_16(bytes, position));
    if (length < 2 || length > bytes.size() - position) {
      return broken("a segment that goes beyond the end", position);
    }
    if (starts_frame(marker) && length >= 7) {
      extent.height_px = big_endian_16(bytes, position + 3);
      extent.width_px = big_endian_16(bytes, position + 5);
    }
    position += length;
    if (marker == kStartOfScan) {
      has_scan = true;
      position = skip_coded_data(bytes, position);
    }
  }
  return broken("it is cut off", bytes.size());
}

}  // namespace trigmesh
