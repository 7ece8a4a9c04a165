#include "sfm/exchange/ply_format.hpp"

#include <array>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh::ply {
namespace {

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
  property.name = reader.word("a name");
  header.elements.back().properties.push_back(std::move(property));
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

void read_element(TextReader& reader, Header& header) {
  Element element;
  element.name = reader.word("a name");
  element.count = reader.integer<std::uint64_t>("a count");
  header.elements.push_back(std::move(element));
}

}  // namespace

std::size_t size_of(Type type) {
  return std::ranges::find(kTypes, type, &TypeName::type)->bytes;
}

std::size_t Element::smallest_bytes() const {
  std::size_t bytes = 0;
  for (const Property& property : properties) {
    bytes += size_of(property.list_count.value_or(property.type));
  }
  return bytes;
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
      read_element(reader, header);
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

double BinaryBody::number(Type type) {
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

Result<std::vector<std::optional<std::size_t>>> places_of(const Element& element,
                                                          std::span<const std::string_view> names) {
  std::vector<std::optional<std::size_t>> places(element.properties.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto found = std::ranges::find(names, element.properties[i].name);
    if (found == names.end() || element.properties[i].list_count) {
      continue;
    }
    const auto place = static_cast<std::size_t>(found - names.begin());
    if (std::ranges::count(places, std::optional(place)) > 0) {
      return fail(ErrorCode::kCorruptData, "the PLY header has two properties '{}'", *found);
    }
    places[i] = place;
  }
  return places;
}

}  // namespace trigmesh::ply
