#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/core.h>

#include "firmware/base/check.hpp"
#include "sfm/exchange/ply.hpp"
#include "sfm/exchange/ply_format.hpp"

namespace trigmesh {
namespace {

constexpr std::array<std::string_view, 11> kPointFields{
    "x", "y", "z", "red", "green", "blue", "nx", "ny", "nz", "confidence", "view_count"};
constexpr std::size_t kColor = 3;
constexpr std::size_t kNormal = 6;
constexpr std::size_t kConfidence = 9;
constexpr std::size_t kViewCount = 10;

using PointValues = std::array<double, kPointFields.size()>;

constexpr PointValues kDefaults{0, 0, 0, 255, 255, 255, 0, 0, 0, 1, 0};

std::uint8_t to_color(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
}

Eigen::Vector3f to_vector(const PointValues& values, std::size_t first) {
  return {static_cast<float>(values[first]),
          static_cast<float>(values[first + 1]),
          static_cast<float>(values[first + 2])};
}

std::array<std::uint8_t, 3> to_rgb(const PointValues& values) {
  return {to_color(values[kColor]), to_color(values[kColor + 1]), to_color(values[kColor + 2])};
}

/// How the vertices of one file become points of type Point: `why_not` names what is wrong with
/// one, `convert` makes it.
struct ColoredPointTraits {
  using Point = ColoredPoint;
  static constexpr std::size_t kFields = kNormal;

  static std::string_view why_not(const PointValues& values) {
    return to_vector(values, 0).allFinite() ? "" : "a vertex is not finite";
  }

  static Point convert(const PointValues& values) { return {to_vector(values, 0), to_rgb(values)}; }
};

struct DensePointTraits {
  using Point = DensePoint;
  static constexpr std::size_t kFields = kPointFields.size();

  static std::string_view why_not(const PointValues& values) {
    if (!to_vector(values, 0).allFinite()) {
      return "a vertex is not finite";
    }
    if (!to_vector(values, kNormal).allFinite()) {
      return "a normal is not finite";
    }
    if (!(values[kConfidence] >= 0.0 && values[kConfidence] <= 1.0)) {
      return "a confidence is not in [0, 1]";
    }
    if (!(values[kViewCount] >= 0.0 &&
          values[kViewCount] <= std::numeric_limits<std::uint16_t>::max())) {
      return "a view count is not in [0, 65535]";
    }
    return "";
  }

  static Point convert(const PointValues& values) {
    return {.position_in_world = to_vector(values, 0),
            .normal_in_world = to_vector(values, kNormal),
            .color_rgb = to_rgb(values),
            .confidence = static_cast<float>(values[kConfidence]),
            .view_count = static_cast<std::uint16_t>(values[kViewCount])};
  }
};

using Places = std::vector<std::optional<std::size_t>>;

/// The places of the fields; colours of another type than uchar are no colours to us.
Result<Places> point_places(const ply::Element& element, std::size_t field_count) {
  TM_ASSIGN_OR_RETURN(Places places,
                      ply::places_of(element, std::span(kPointFields).first(field_count)));
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool is_color = places[i] && *places[i] >= kColor && *places[i] < kNormal;
    if (is_color && element.properties[i].type != ply::Type::kUint8) {
      places[i].reset();
    }
  }
  return places;
}

bool has_position(const Places& places) {
  return std::ranges::count_if(places,
                               [](const auto& place) { return place && *place < kColor; }) == 3;
}

template <typename Traits, typename Body>
Result<std::vector<typename Traits::Point>> read_vertices(Body& body,
                                                          const ply::Element& element,
                                                          const Places& places) {
  std::vector<typename Traits::Point> points;
  points.reserve(static_cast<std::size_t>(element.count));
  for (std::uint64_t i = 0; i < element.count && body.next_item(); ++i) {
    PointValues values = kDefaults;
    ply::read_item(body, element, places, values);
    if (const std::string_view reason = Traits::why_not(values); !reason.empty()) {
      body.reject(reason);
      break;
    }
    points.push_back(Traits::convert(values));
  }
  TM_RETURN_IF_ERROR(body.status());
  return points;
}

template <typename Traits, typename Body>
Result<std::vector<typename Traits::Point>> read_body(Body body, const ply::Header& header) {
  for (const ply::Element& element : header.elements) {
    if (element.properties.empty()) {
      continue;
    }
    TM_RETURN_IF_ERROR(ply::expect_items(body, element));
    if (element.name != "vertex") {
      TM_RETURN_IF_ERROR(ply::skip_element(body, element));
      continue;
    }
    TM_ASSIGN_OR_RETURN(const Places places, point_places(element, Traits::kFields));
    if (!has_position(places)) {
      break;
    }
    return read_vertices<Traits>(body, element, places);
  }
  return fail(ErrorCode::kCorruptData, "the PLY file has no vertices with x, y and z");
}

template <typename Traits>
Result<std::vector<typename Traits::Point>> read_points(std::string_view bytes) {
  TM_ASSIGN_OR_RETURN(const ply::Header header, ply::read_header(bytes));
  const std::string_view body = bytes.substr(header.bytes);
  if (header.format == ply::Format::kAscii) {
    return read_body<Traits>(ply::AsciiBody(body), header);
  }
  return read_body<Traits>(ply::BinaryBody(body), header);
}

void append(ByteWriter& out, const Eigen::Vector3f& vector) {
  for (const float value : vector) {
    out.value<float>(value);
  }
}

void append(ByteWriter& out, const std::array<std::uint8_t, 3>& color) {
  for (const std::uint8_t value : color) {
    out.value<std::uint8_t>(value);
  }
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
    append(out, point.position_in_world);
    append(out, point.color_rgb);
  }
  return std::move(out).take();
}

Result<std::vector<ColoredPoint>> read_ply(std::string_view bytes) {
  return read_points<ColoredPointTraits>(bytes);
}

std::string write_dense_ply(std::span<const DensePoint> points) {
  constexpr std::size_t kPointBytes = 7 * sizeof(float) + 3 + sizeof(std::uint16_t);
  ByteWriter out;
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float confidence\nproperty ushort view_count\nend_header\n",
      points.size());
  out.reserve(header.size() + points.size() * kPointBytes);
  out.text(header);
  for (const DensePoint& point : points) {
    append(out, point.position_in_world);
    append(out, point.normal_in_world);
    append(out, point.color_rgb);
    out.value<float>(point.confidence);
    out.value<std::uint16_t>(point.view_count);
  }
  return std::move(out).take();
}

Result<DenseCloud> read_dense_ply(std::string_view bytes) {
  return read_points<DensePointTraits>(bytes);
}

}  // namespace trigmesh
