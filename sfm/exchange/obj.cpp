#include "sfm/exchange/obj.hpp"

#include <algorithm>
#include <bit>
#include <iterator>
#include <string_view>
#include <unordered_map>

#include <fmt/core.h>

#include "firmware/base/check.hpp"
#include "sfm/exchange/file_io.hpp"

namespace trigmesh {
namespace {

Result<> check_stem(std::string_view stem) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  if (stem.empty() || stem.size() > 100 || !std::ranges::all_of(stem, is_plain)) {
    return fail(ErrorCode::kInvalidArgument,
                "the name of OBJ files must consist of letters, digits, '_' and '-'");
  }
  return {};
}

std::string page_name(const TexturedMesh& textured, const ObjOptions& options, std::size_t page) {
  const char* const extension = options.pages.format == ImageFormat::kPng ? "png" : "jpg";
  return textured.pages.size() == 1 ? fmt::format("{}.{}", options.stem, extension)
                                    : fmt::format("{}_{}.{}", options.stem, page, extension);
}

/// Faces in the order of their pages, those without extent left out.
std::vector<std::uint32_t> faces_in_page_order(const TexturedMesh& textured) {
  std::vector<std::uint32_t> faces;
  faces.reserve(textured.mesh.faces.size());
  for (std::uint32_t i = 0; i < textured.mesh.faces.size(); ++i) {
    if (has_extent(textured.mesh.faces[i])) {
      faces.push_back(i);
    }
  }
  std::ranges::stable_sort(faces, {}, [&](std::uint32_t i) { return textured.face_page[i]; });
  return faces;
}

/// Numbers texture coordinates, equal ones alike; writes a line for each new one.
class CoordinateTable {
 public:
  std::size_t number_of(const Eigen::Vector2f& uv, std::string& lines) {
    const std::uint64_t key = (std::uint64_t{std::bit_cast<std::uint32_t>(uv.x())} << 32U) |
                              std::bit_cast<std::uint32_t>(uv.y());
    const auto [entry, is_new] = numbers_.try_emplace(key, numbers_.size() + 1);
    if (is_new) {
      fmt::format_to(std::back_inserter(lines), "vt {} {}\n", uv.x(), 1.0F - uv.y());
    }
    return entry->second;
  }

 private:
  std::unordered_map<std::uint64_t, std::size_t> numbers_;  // looked up, never iterated
};

void append_vectors(std::string& text,
                    std::string_view keyword,
                    const std::vector<Eigen::Vector3f>& vectors) {
  for (const Eigen::Vector3f& v : vectors) {
    fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", keyword, v.x(), v.y(), v.z());
  }
}

/// Texture coordinates and then the faces, page by page.
std::string face_lines(const TexturedMesh& textured, const std::vector<std::uint32_t>& faces) {
  std::string coordinates;
  std::string lines;
  CoordinateTable table;
  std::optional<std::uint16_t> page;
  for (const std::uint32_t face : faces) {
    if (page != textured.face_page[face]) {
      page = textured.face_page[face];
      fmt::format_to(std::back_inserter(lines), "usemtl page_{}\n", *page);
    }
    lines += 'f';
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t vertex = std::size_t{textured.mesh.faces[face][corner]} + 1;
      const std::size_t uv = table.number_of(textured.face_uv[face][corner], coordinates);
      fmt::format_to(std::back_inserter(lines), " {}/{}/{}", vertex, uv, vertex);
    }
    lines += '\n';
  }
  return coordinates + lines;
}

std::string obj_text(const TexturedMesh& textured,
                     const std::vector<std::uint32_t>& faces,
                     const ObjOptions& options) {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
  positions.reserve(textured.mesh.positions.size());
  for (const Eigen::Vector3f& position : textured.mesh.positions) {
    positions.push_back(options.placement.point(position));
  }
  for (const Eigen::Vector3f& normal : unit_normals(textured.mesh)) {
    normals.push_back(options.placement.direction(normal));
  }
  std::string text = fmt::format("# trigmesh, Y up, lengths in {}\nmtllib {}.mtl\no {}\n",
                                 options.placement.metres_per_unit ? "metres" : "scene units",
                                 options.stem,
                                 options.stem);
  append_vectors(text, "v", positions);
  append_vectors(text, "vn", normals);
  text += face_lines(textured, faces);
  return text;
}

/// Diffuse only: the light is in the picture already.
std::string material_text(std::size_t page, std::string_view picture) {
  return fmt::format(
      "newmtl page_{}\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nd 1\nillum 1\nmap_Kd {}\n\n", page, picture);
}

std::string to_text(const std::vector<std::uint8_t>& bytes) {
  return {bytes.begin(), bytes.end()};
}

}  // namespace

Result<std::vector<NamedFile>> write_obj(const TexturedMesh& textured, const ObjOptions& options) {
  TM_RETURN_IF_ERROR(check_stem(options.stem));
  TM_RETURN_IF_ERROR(options.placement.validate());
  TM_RETURN_IF_ERROR(check_mesh(textured));
  const std::vector<std::uint32_t> faces = faces_in_page_order(textured);
  std::vector<NamedFile> files;
  std::string materials = "# trigmesh\n";
  std::optional<std::uint16_t> last;
  for (const std::uint32_t face : faces) {
    const std::uint16_t page = textured.face_page[face];
    if (page == last) {
      continue;
    }
    last = page;
    TM_ASSIGN_OR_RETURN(const std::vector<std::uint8_t> picture,
                        encode_page(textured.pages[page], options.pages));
    files.push_back({page_name(textured, options, page), to_text(picture)});
    materials += material_text(page, files.back().name);
  }
  files.push_back({options.stem + ".mtl", std::move(materials)});
  files.push_back({options.stem + ".obj", obj_text(textured, faces, options)});
  return files;
}

Result<> write_files(const std::filesystem::path& folder, const std::vector<NamedFile>& files) {
  for (const NamedFile& file : files) {
    TM_RETURN_IF_ERROR(write_file_atomically(folder / file.name, file.bytes));
  }
  return {};
}

}  // namespace trigmesh
