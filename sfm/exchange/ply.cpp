#include "sfm/exchange/ply.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/exchange/byte_io.hpp"
#include "sfm/exchange/text_reader.hpp"

namespace trigmesh {
namespace {

enum class Format { kAscii, kBinaryLittleEndian };
enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct TypeName {
  std::string_view name;
  std::string_view other_name;
  Type type;
  std::size_t bytes;
};

constexpr std::array kTypes{TypeName{"char", "int8", Type::kInt8, 1},
                            TypeName{"uchar", "uint8", Type::kUint8, 1},
                            TypeName{"short", "int16", Type::kInt16, 2},
                            TypeName{"ushort", "uint16", Type::kUint16, 2},
                            TypeName{"int", "int32", Type::kInt32, 4},
                            TypeName{"uint", "uint32", Type::kUint32, 4},
                            TypeName{"float", "float32", Type::kFloat32, 4},
                            TypeName{"double", "float64", Type::kFloat64, 8}};

std::size_t size_of(Type type) {
  return std::ranges::find(kTypes, type, &TypeName::type)->bytes;
}

/// What a property is to us: the place in {x, y, z, red, green, blue}, or nothing.
std::optional<std::size_t> field_of(std::string_view name, Type type) {
  static constexpr std::array<std::string_view, 6> kFields{"x", "y", "z", "red", "green", "blue"};
  const auto* const found = std::ranges::find(kFields, name);
  const auto place = static_cast<std::size_t>(found - kFields.begin());
  if (place < 3 || (place < kFields.size() && type == Type::kUint8)) {
    return place;
  }
  return std::nullopt;
}

struct Property {
  Type type = Type::kFloat32;
  std::optional<Type> list_count;    ///< type of the count when the property is a list
  std::optional<std::size_t> field;  ///< see field_of
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  /// The fewest bytes that one item can take in a binary file.
  [[nodiscard]] std::size_t smallest_bytes() const {
    std::size_t bytes = 0;
    for (const Property& property : properties) {
      bytes += size_of(property.list_count.value_or(property.type));
    }
    return bytes;
  }
};

struct Header {
  Format format = Format::kAscii;
  std::vector<Element> elements;
  std::size_t bytes = 0;
};

Type read_type(TextReader& reader) {
  const std::string_view name = reader.word("a type");
  const auto* const found = std::ranges::find_if(
      kTypes, [&](const TypeName& type) { return type.name == name || type.other_name == name; });
  if (found == kTypes.end()) {
    reader.reject("the type of a property is unknown");
    return Type::kInt8;
  }
  return found->type;
}

void read_property(TextReader& reader, Header& header) {
  constexpr std::size_t kMostProperties = 256;
  if (header.elements.empty() || header.elements.back().properties.size() == kMostProperties) {
    reader.reject("a property without an element, or too many of them");
    return;
  }
  Property property;
  TextReader ahead = reader;
  if (ahead.word("a type") == "list") {
    (void)reader.word("a type");
    property.list_count = read_type(reader);
    if (property.list_count == Type::kFloat32 || property.list_count == Type::kFloat64) {
      reader.reject("the length of a list is no integer");
    }
  }
  property.type = read_type(reader);
  const std::string_view name = reader.word("a name");
  if (!property.list_count) {
    property.field = field_of(name, property.type);
  }
  header.elements.back().properties.push_back(property);
}

void read_format(TextReader& reader, Header& header) {
  const std::string_view format = reader.word("a format");
  if (format == "ascii") {
    header.format = Format::kAscii;
  } else if (format == "binary_little_endian") {
    header.format = Format::kBinaryLittleEndian;
  } else {
    reader.reject("the format is neither ascii nor binary_little_endian", ErrorCode::kUnsupported);
  }
}

Result<Header> read_header(std::string_view bytes) {
  constexpr std::string_view kEnd = "\nend_header";
  constexpr std::size_t kLongestHeader = std::size_t{1} << 16;
  constexpr std::size_t kMostElements = 64;
  if (!bytes.starts_with("ply\n") && !bytes.starts_with("ply\r\n")) {
    return fail(ErrorCode::kCorruptData, "not a PLY file: it does not begin with 'ply'");
  }
  const std::size_t end = bytes.substr(0, kLongestHeader).find(kEnd);
  const std::size_t line_end = bytes.find('\n', end == bytes.npos ? end : end + kEnd.size());
  if (line_end == bytes.npos) {
    return fail(ErrorCode::kCorruptData, "the header of the PLY file has no end");
  }
  Header header;
  header.bytes = line_end + 1;
  TextReader reader(bytes.substr(0, end + 1), "PLY header");
  bool has_format = false;
  reader.next_line();
  while (reader.next_record()) {
    const std::string_view keyword = reader.word("a keyword");
    if (keyword == "format") {
      read_format(reader, header);
      has_format = true;
    } else if (keyword == "element" && header.elements.size() < kMostElements) {
      Element element;
      element.name = reader.word("a name");
      element.count = reader.integer<std::uint64_t>("a count");
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      read_property(reader, header);
    } else if (keyword != "comment" && keyword != "obj_info") {
      reader.reject("the keyword is unknown, or there are too many elements");
    }
  }
  if (!has_format) {
    reader.reject("the format is missing");
  }
  TM_RETURN_IF_ERROR(reader.status());
  return header;
}

/// Values of a binary body, as double.
class BinaryBody {
 public:
  explicit BinaryBody(std::string_view bytes) : reader_(bytes, "PLY body") {}

  bool next_item() { return reader_.ok(); }

  double number(Type type) {
    switch (type) {
      case Type::kInt8:
        return reader_.value<std::int8_t>();
      case Type::kUint8:
        return reader_.value<std::uint8_t>();
      case Type::kInt16:
        return reader_.value<std::int16_t>();
      case Type::kUint16:
        return reader_.value<std::uint16_t>();
      case Type::kInt32:
        return reader_.value<std::int32_t>();
      case Type::kUint32:
        return reader_.value<std::uint32_t>();
      case Type::kFloat32:
        return static_cast<double>(reader_.value<float>());
      case Type::kFloat64:
        return reader_.value<double>();
    }
    return 0.0;
  }

  void skip(Type type, std::size_t count) {
    if (count > reader_.remaining() / size_of(type)) {
      reader_.reject("a list is longer than the file");
      return;
    }
    reader_.skip(count * size_of(type));
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

/// x y z red green blue of one item.
using Fields = std::array<double, 6>;

template <typename Body>
Fields read_item(Body& body, const Element& element) {
  Fields fields{0, 0, 0, 255, 255, 255};
  for (const Property& property : element.properties) {
    const double value = body.number(property.list_count.value_or(property.type));
    if (property.list_count) {
      if (!(value >= 0.0)) {
        body.reject("the length of a list is negative");
        return fields;
      }
      body.skip(property.type, static_cast<std::size_t>(std::min(value, 1e15)));
    } else if (property.field) {
      fields[*property.field] = value;
    }
  }
  return fields;
}

std::uint8_t to_color(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
}

template <typename Body>
std::vector<ColoredPoint> read_vertices(Body& body, const Element& element) {
  std::vector<ColoredPoint> points;
  points.reserve(static_cast<std::size_t>(element.count));
  for (std::uint64_t i = 0; i < element.count && body.next_item(); ++i) {
    const Fields fields = read_item(body, element);
    const Eigen::Vector3f position(static_cast<float>(fields[0]),
                                   static_cast<float>(fields[1]),
                                   static_cast<float>(fields[2]));
    if (!position.allFinite()) {
      body.reject("a vertex is not finite");
      break;
    }
    points.push_back({position, {to_color(fields[3]), to_color(fields[4]), to_color(fields[5])}});
  }
  return points;
}

bool has_position(const Element& element) {
  for (std::size_t field = 0; field < 3; ++field) {
    if (std::ranges::count(element.properties, std::optional(field), &Property::field) != 1) {
      return false;
    }
  }
  return true;
}

template <typename Body>
Result<std::vector<ColoredPoint>> read_body(Body body, const Header& header) {
  for (const Element& element : header.elements) {
    if (element.properties.empty()) {
      continue;
    }
    if (!body.can_hold(element)) {
      return fail(ErrorCode::kCorruptData,
                  "the PLY file is too short for {} items of '{}'",
                  element.count,
                  element.name);
    }
    if (element.name != "vertex") {
      for (std::uint64_t i = 0; i < element.count && body.next_item(); ++i) {
        (void)read_item(body, element);
      }
      TM_RETURN_IF_ERROR(body.status());
      continue;
    }
    if (!has_position(element)) {
      break;
    }
    std::vector<ColoredPoint> points = read_vertices(body, element);
    TM_RETURN_IF_ERROR(body.status());
    return points;
  }
  return fail(ErrorCode::kCorruptData, "the PLY file has no vertices with x, y and z");
}

}  // namespace

std::vector<ColoredPoint> colored_points(const Scene& scene) {
  std::vector<ColoredPoint> points;
  points.reserve(scene.landmarks.size());
  for (const Landmark& landmark : scene.landmarks) {
    points.push_back({landmark.position_in_world.cast<float>(), landmark.color_rgb});
  }
  return points;
}

std::string write_ply(std::span<const ColoredPoint> points) {
  ByteWriter out;
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      points.size());
  out.reserve(header.size() + points.size() * (3 * sizeof(float) + 3));
  out.text(header);
  for (const ColoredPoint& point : points) {
    for (const float value : point.position_in_world) {
      out.value<float>(value);
    }
    for (const std::uint8_t value : point.color_rgb) {
      out.value<std::uint8_t>(value);
    }
  }
  return std::move(out).take();
}

Result<std::vector<ColoredPoint>> read_ply(std::string_view bytes) {
  TM_ASSIGN_OR_RETURN(const Header header, read_header(bytes));
  const std::string_view body = bytes.substr(header.bytes);
  if (header.format == Format::kAscii) {
    return read_body(AsciiBody(body), header);
  }
  return read_body(BinaryBody(body), header);
}

}  // namespace trigmesh
