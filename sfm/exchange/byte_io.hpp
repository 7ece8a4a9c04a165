#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "firmware/base/result.hpp"

namespace trigmesh {

static_assert(std::endian::native == std::endian::little,
              "the formats are little endian; this program runs on little endian boards only");

template <typename T>
concept Scalar = std::is_arithmetic_v<T>;

/// Reads little endian values from bytes in memory. Like TextReader, the first failure sticks:
/// values are zero from then on and `status()` is kCorruptData with the position.
class ByteReader {
 public:
  /// `bytes` must outlive the reader; `source` names it in messages.
  ByteReader(std::string_view bytes, std::string_view source) : bytes_(bytes), source_(source) {}

  template <Scalar T>
  T value() {
    T result{};
    if (remaining() < sizeof(T)) {
      reject("the file ends too early");
      return result;
    }
    std::memcpy(&result, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return result;
  }

  /// A 64-bit count of items of at least `item_bytes` (> 0) each. A count that cannot fit in what
  /// is left of the file is a failure, so it is safe to reserve memory for it.
  std::size_t count(std::size_t item_bytes) {
    const auto items = value<std::uint64_t>();
    if (items > remaining() / item_bytes) {
      reject(fmt::format("{} items are announced, the file is too short for them", items));
      return 0;
    }
    return static_cast<std::size_t>(items);
  }

  /// Text up to a zero byte, which is consumed.
  std::string_view zero_terminated() {
    const std::string_view left = ok() ? bytes_.substr(position_) : std::string_view{};
    const std::size_t end = left.find('\0');
    if (end == std::string_view::npos) {
      reject("a text has no end");
      return {};
    }
    position_ += end + 1;
    return left.substr(0, end);
  }

  [[nodiscard]] std::size_t remaining() const { return ok() ? bytes_.size() - position_ : 0; }

  [[nodiscard]] std::size_t position() const { return position_; }

  void skip(std::size_t bytes) {
    if (bytes > remaining()) {
      reject("the file ends too early");
      return;
    }
    position_ += bytes;
  }

  void reject(std::string_view reason, ErrorCode code = ErrorCode::kCorruptData) {
    if (ok()) {
      error_ = {code, fmt::format("{}, byte {}: {}", source_, position_, reason)};
    }
  }

  [[nodiscard]] bool ok() const { return error_.message.empty(); }

  [[nodiscard]] Result<> status() const {
    if (ok()) {
      return {};
    }
    return tl::unexpected<Error>(error_);
  }

 private:
  std::string_view bytes_;
  std::string source_;
  std::size_t position_ = 0;
  Error error_;
};

/// Appends little endian values to a string of bytes.
class ByteWriter {
 public:
  template <Scalar T>
  void value(std::type_identity_t<T> number) {
    const auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(static_cast<T>(number));
    bytes_.append(bytes.data(), bytes.size());
  }

  void text(std::string_view characters) { bytes_.append(characters); }

  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }

  [[nodiscard]] std::string take() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

}  // namespace trigmesh
