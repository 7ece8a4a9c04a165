#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {

static_assert(std::endian::native == std::endian::little, "values are stored little endian");

/// A type whose bytes are its value.
template <typename T>
concept PlainData = std::is_trivially_copyable_v<T>;

/// Appends plain values and vectors (u64 count, then the items) to a byte buffer.
class BinaryWriter {
 public:
  template <PlainData T>
  void value(const T& v) {
    append(&v, sizeof(T));
  }

  template <PlainData T>
  void items(const std::vector<T>& v) {
    value(static_cast<std::uint64_t>(v.size()));
    append(v.data(), v.size() * sizeof(T));
  }

  /// u64 length, then the characters.
  void text(std::string_view characters) {
    value(static_cast<std::uint64_t>(characters.size()));
    append(characters.data(), characters.size());
  }

  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  // Not inline: g++ 12 sees overflows in vectors whose size it half knows.
  void append(const void* data, std::size_t size);

  std::vector<std::uint8_t> bytes_;
};

/// Reads what BinaryWriter wrote. After the first read beyond the end every value is empty and `ok`
/// is false, so that a decoder checks once, at its end. Counts are checked against what is left
/// before memory is taken.
class BinaryReader {
 public:
  explicit BinaryReader(std::span<const std::uint8_t> bytes) : left_(bytes) {}

  template <PlainData T>
  [[nodiscard]] T value() {
    T v{};
    copy(&v, sizeof(T));
    return v;
  }

  template <PlainData T>
  [[nodiscard]] std::vector<T> items() {
    const auto count = value<std::uint64_t>();
    if (!ok_ || count > left_.size() / sizeof(T)) {
      ok_ = false;
      return {};
    }
    std::vector<T> v(static_cast<std::size_t>(count));
    copy(v.data(), v.size() * sizeof(T));
    return v;
  }

  [[nodiscard]] std::string text() {
    const std::vector<char> characters = items<char>();
    return {characters.begin(), characters.end()};
  }

  /// Everything so far was there.
  [[nodiscard]] bool ok() const { return ok_; }

  /// Everything was there and nothing is left over.
  [[nodiscard]] bool complete() const { return ok_ && left_.empty(); }

 private:
  void copy(void* to, std::size_t size) {
    if (!ok_ || size > left_.size()) {
      ok_ = false;
      return;
    }
    if (size > 0) {
      std::memcpy(to, left_.data(), size);
    }
    left_ = left_.subspan(size);
  }

  std::span<const std::uint8_t> left_;
  bool ok_ = true;
};

}  // namespace trigmesh
