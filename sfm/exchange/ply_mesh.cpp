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

constexpr std::array<std::string_view, 9> kVertexFields{
    "x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"};
constexpr std::size_t kNormal = 3;
constexpr std::size_t kColor = 6;

using Places = std::vector<std::optional<std::size_t>>;

/// Whether all three of a vector are there; of some type `only`, when it is given.
bool has_three(const ply::Element& element,
               const Places& places,
               std::size_t first,
               std::optional<ply::Type> only = {}) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i] && *places[i] >= first && *places[i] < first + 3 &&
        (!only || element.properties[i].type == *only)) {
      ++found;
    }
  }
  return found == 3;
}

Eigen::Vector3f to_vector(std::span<const double, 3> values) {
  return {
      static_cast<float>(values[0]), static_cast<float>(values[1]), static_cast<float>(values[2])};
}

std::uint8_t to_color(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
}

template <typename Body>
Result<> read_vertices(Body& body, const ply::Element& element, TriangleMesh& mesh) {
  TM_ASSIGN_OR_RETURN(const Places places, ply::places_of(element, kVertexFields));
  if (!has_three(element, places, 0)) {
    return fail(ErrorCode::kCorruptData, "the vertices of the PLY file have no x, y and z");
  }
  const bool has_normals = has_three(element, places, kNormal);
  const bool has_colors = has_three(element, places, kColor, ply::Type::kUint8);
  mesh.positions.reserve(static_cast<std::size_t>(element.count));
  std::array<double, kVertexFields.size()> values{};
  const std::span<const double, kVertexFields.size()> view(values);
  for (std::uint64_t i = 0; i < element.count && body.next_item(); ++i) {
    ply::read_item(body, element, places, values);
    mesh.positions.push_back(to_vector(view.first<3>()));
    if (!mesh.positions.back().allFinite()) {
      body.reject("a vertex is not finite");
    }
    if (has_normals) {
      mesh.normals.push_back(to_vector(view.subspan<kNormal, 3>()));
      if (!mesh.normals.back().allFinite()) {
        body.reject("a normal is not finite");
      }
    }
    if (has_colors) {
      mesh.colors.push_back(
          {to_color(values[kColor]), to_color(values[kColor + 1]), to_color(values[kColor + 2])});
    }
  }
  return body.status();
}

/// One corner of a face: an integer that fits, whether or not the vertex exists.
template <typename Body>
std::uint32_t read_corner(Body& body, ply::Type type) {
  const double value = body.number(type);
  if (!(value >= 0.0 && value <= std::numeric_limits<std::uint32_t>::max()) ||
      value != std::floor(value)) {
    body.reject("a corner of a face is no vertex number");
    return 0;
  }
  return static_cast<std::uint32_t>(value);
}

template <typename Body>
void read_face(Body& body,
               const ply::Property& property,
               std::vector<std::array<std::uint32_t, 3>>& faces) {
  const std::size_t corners = ply::list_length(body, property);
  if (!body.expect_values(property.type, corners)) {
    return;
  }
  if (corners < 3) {
    body.reject("a face has fewer than three corners");
    return;
  }
  const std::uint32_t first = read_corner(body, property.type);
  std::uint32_t previous = read_corner(body, property.type);
  for (std::size_t i = 2; i < corners && body.ok(); ++i) {
    const std::uint32_t corner = read_corner(body, property.type);
    faces.push_back({first, previous, corner});
    previous = corner;
  }
}

bool is_corner_list(const ply::Property& property) {
  return property.list_count &&
         (property.name == "vertex_indices" || property.name == "vertex_index");
}

template <typename Body>
Result<> read_faces(Body& body, const ply::Element& element, TriangleMesh& mesh) {
  if (std::ranges::count_if(element.properties, is_corner_list) != 1) {
    return fail(ErrorCode::kCorruptData,
                "the faces of the PLY file have no list (or more than one) of vertex_indices");
  }
  mesh.faces.reserve(static_cast<std::size_t>(element.count));
  for (std::uint64_t i = 0; i < element.count && body.next_item(); ++i) {
    for (const ply::Property& property : element.properties) {
      if (is_corner_list(property)) {
        read_face(body, property, mesh.faces);
      } else if (property.list_count) {
        body.skip(property.type, ply::list_length(body, property));
      } else {
        body.skip(property.type, 1);
      }
    }
  }
  return body.status();
}

Result<> check_faces(const TriangleMesh& mesh) {
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
    const std::uint32_t largest = std::ranges::max(mesh.faces[i]);
    if (largest >= mesh.positions.size()) {
      return fail(ErrorCode::kCorruptData,
                  "triangle {} of the PLY file has vertex {}, there are {}",
                  i,
                  largest,
                  mesh.positions.size());
    }
  }
  return {};
}

template <typename Body>
Result<TriangleMesh> read_body(Body body, const ply::Header& header) {
  TriangleMesh mesh;
  bool has_vertices = false;
  bool has_faces = false;
  for (const ply::Element& element : header.elements) {
    const bool is_vertex = element.name == "vertex";
    const bool is_face = element.name == "face";
    if ((is_vertex && has_vertices) || (is_face && has_faces)) {
      return fail(ErrorCode::kCorruptData, "the PLY file has two elements '{}'", element.name);
    }
    has_vertices = has_vertices || is_vertex;
    has_faces = has_faces || is_face;
    if (element.properties.empty() && !is_vertex && !is_face) {
      continue;
    }
    TM_RETURN_IF_ERROR(ply::expect_items(body, element));
    if (is_vertex) {
      TM_RETURN_IF_ERROR(read_vertices(body, element, mesh));
    } else if (is_face) {
      TM_RETURN_IF_ERROR(read_faces(body, element, mesh));
    } else {
      TM_RETURN_IF_ERROR(ply::skip_element(body, element));
    }
  }
  if (!has_vertices || !has_faces) {
    return fail(ErrorCode::kCorruptData, "the PLY file is no mesh: it lacks vertices or faces");
  }
  TM_RETURN_IF_ERROR(check_faces(mesh));
  return mesh;
}

std::string mesh_header(const TriangleMesh& mesh) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n{}{}"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.positions.size(),
      mesh.normals.empty() ? "" : "property float nx\nproperty float ny\nproperty float nz\n",
      mesh.colors.empty() ? "" : "property uchar red\nproperty uchar green\nproperty uchar blue\n",
      mesh.faces.size());
}

}  // namespace

std::string write_mesh_ply(const TriangleMesh& mesh) {
  TM_CHECK(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size());
  TM_CHECK(mesh.colors.empty() || mesh.colors.size() == mesh.positions.size());
  TM_CHECK(mesh.positions.size() <=
           static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()));
  constexpr std::size_t kMostVertexBytes = 6 * sizeof(float) + 3;
  constexpr std::size_t kFaceBytes = 1 + 3 * sizeof(std::int32_t);
  ByteWriter out;
  const std::string header = mesh_header(mesh);
  out.reserve(header.size() + mesh.positions.size() * kMostVertexBytes +
              mesh.faces.size() * kFaceBytes);
  out.text(header);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (const float value : mesh.positions[i]) {
      out.value<float>(value);
    }
    if (!mesh.normals.empty()) {
      for (const float value : mesh.normals[i]) {
        out.value<float>(value);
      }
    }
    if (!mesh.colors.empty()) {
      for (const std::uint8_t value : mesh.colors[i]) {
        out.value<std::uint8_t>(value);
      }
    }
  }
  for (const std::array<std::uint32_t, 3>& face : mesh.faces) {
    out.value<std::uint8_t>(3);
    for (const std::uint32_t corner : face) {
      out.value<std::int32_t>(static_cast<std::int32_t>(corner));
    }
  }
  return std::move(out).take();
}

Result<TriangleMesh> read_mesh_ply(std::string_view bytes) {
  TM_ASSIGN_OR_RETURN(const ply::Header header, ply::read_header(bytes));
  const std::string_view body = bytes.substr(header.bytes);
  if (header.format == ply::Format::kAscii) {
    return read_body(ply::AsciiBody(body), header);
  }
  return read_body(ply::BinaryBody(body), header);
}

}  // namespace trigmesh
