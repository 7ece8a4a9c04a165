#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/exchange/byte_io.hpp"
#include "sfm/exchange/text_reader.hpp"

// The parts that all readers of PLY share: the header, and the values of the two kinds of body. For
// ply_points.cpp and ply_mesh.cpp only.

namespace trigmesh::ply {

enum class Format { kAscii, kBinaryLittleEndian };
enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

[[nodiscard]] std::size_t size_of(Type type);

struct Property {
  std::string name;
  Type type = Type::kFloat32;
  std::optional<Type> list_count;  ///< type of the count when the property is a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  /// The fewest bytes that one item can take in a binary file.
  [[nodiscard]] std::size_t smallest_bytes() const;
};

struct Header {
  Format format = Format::kAscii;
  std::vector<Element> elements;
  std::size_t bytes = 0;  ///< where the body begins
};

/// kCorruptData for what is no PLY, kUnsupported for big endian. At most 64 elements of 256
/// properties.
[[nodiscard]] Result<Header> read_header(std::string_view bytes);

/// Values of a binary body, as double.
class BinaryBody {
 public:
  explicit BinaryBody(std::string_view bytes) : reader_(bytes, "PLY body") {}

  bool next_item() { return reader_.ok(); }

  double number(Type type);

  /// Whether `count` values of a list can still follow; a failure when not.
  bool expect_values(Type type, std::size_t count) {
    if (count > reader_.remaining() / size_of(type)) {
      reader_.reject("a list is longer than the file");
    }
    return reader_.ok();
  }

  void skip(Type type, std::size_t count) {
    if (expect_values(type, count)) {
      reader_.skip(count * size_of(type));
    }
  }

  void reject(std::string_view reason) { reader_.reject(reason); }

  [[nodiscard]] bool ok() const { return reader_.ok(); }

  [[nodiscard]] Result<> status() const { return reader_.status(); }

  [[nodiscard]] bool can_hold(const Element& element) const {
    const std::size_t bytes = element.smallest_bytes();
    return bytes == 0 || element.count <= reader_.remaining() / bytes;
  }

 private:
  ByteReader reader_;
};

/// Values of an ASCII body: one item a line.
class AsciiBody {
 public:
  explicit AsciiBody(std::string_view text) : reader_(text, "PLY body"), bytes_(text.size()) {}

  bool next_item() {
    if (!reader_.next_record()) {
      reader_.reject("the file ends too early");
    }
    return reader_.ok();
  }

  double number(Type /*type*/) { return reader_.real("a number"); }

  /// A value takes at least a digit and a blank, so more than these cannot follow.
  bool expect_values(Type /*type*/, std::size_t count) {
    if (count > bytes_) {
      reader_.reject("a list is longer than the file");
    }
    return reader_.ok();
  }

  void skip(Type /*type*/, std::size_t count) {
    for (std::size_t i = 0; i < count && reader_.ok(); ++i) {
      (void)reader_.word("a number");
    }
  }

  void reject(std::string_view reason) { reader_.reject(reason); }

  [[nodiscard]] bool ok() const { return reader_.ok(); }

  [[nodiscard]] Result<> status() const { return reader_.status(); }

  [[nodiscard]] bool can_hold(const Element& element) const { return element.count <= bytes_; }

 private:
  TextReader reader_;
  std::size_t bytes_;
};

/// The length of a list; a failure when it is negative.
template <typename Body>
std::size_t list_length(Body& body, const Property& property) {
  const double length = body.number(*property.list_count);
  if (!(length >= 0.0)) {
    body.reject("the length of a list is negative");
    return 0;
  }
  return static_cast<std::size_t>(std::min(length, 1e15));
}

/// For each property its place among `names`; nothing for lists and for other names. A name that
/// comes twice is kCorruptData.
[[nodiscard]] Result<std::vector<std::optional<std::size_t>>> places_of(
    const Element& element, std::span<const std::string_view> names);

/// One item: writes what has a place to `values`, steps over the rest. Values are finite.
template <typename Body>
void read_item(Body& body,
               const Element& element,
               std::span<const std::optional<std::size_t>> places,
               std::span<double> values) {
  for (std::size_t i = 0; i < element.properties.size() && body.ok(); ++i) {
    const Property& property = element.properties[i];
    if (property.list_count) {
      body.skip(property.type, list_length(body, property));
      continue;
    }
    const double value = body.number(property.type);
    if (places[i]) {
      values[*places[i]] = value;
    }
  }
}

template <typename Body>
Result<> skip_element(Body& body, const Element& element) {
  const std::vector<std::optional<std::size_t>> no_places(element.properties.size());
  for (std::uint64_t i = 0; i < element.count && body.next_item(); ++i) {
    read_item(body, element, no_places, {});
  }
  return body.status();
}

/// kCorruptData when an element announces more items than the rest of the file can hold.
template <typename Body>
Result<> expect_items(const Body& body, const Element& element) {
  if (!body.can_hold(element)) {
    return fail(ErrorCode::kCorruptData,
                "the PLY file is too short for {} items of '{}'",
                element.count,
                element.name);
  }
  return {};
}

}  // namespace trigmesh::ply
