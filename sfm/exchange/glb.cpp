// glTF 2.0 specification, Khronos Group, 2021: section 3.6.2.4 (alignment), 3.7.2.1 (COLOR_0 is
// linear), 4 (GLB); extension KHR_materials_unlit.
#include "sfm/exchange/glb.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>
#include <utility>

#include <tiny_gltf.h>

#include <nlohmann/json.hpp>

#include "firmware/base/check.hpp"
#include "sfm/exchange/byte_io.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kAlignment = 4;
constexpr std::size_t kMostBufferBytes = std::numeric_limits<std::uint32_t>::max() - (1U << 20U);
constexpr std::size_t kFileHeadBytes = 12;
constexpr std::size_t kChunkHeadBytes = 8;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"
constexpr const char* kUnlit = "KHR_materials_unlit";

/// The vertices and faces of one primitive.
struct Surface {
  std::vector<Eigen::Vector3f> positions;  ///< in the model
  std::vector<Eigen::Vector3f> normals;
  std::vector<Eigen::Vector2f> uvs;                  ///< or empty
  std::vector<std::array<std::uint16_t, 4>> colors;  ///< or empty
  std::vector<std::uint32_t> corners;                ///< three for each face
};

/// A model whose one buffer lies beside it, in parts, so that the file can be put together with no
/// second copy of it: tinygltf alone would hold three.
struct GlbModel {
  tinygltf::Model json;
  std::vector<std::vector<std::uint8_t>> parts;  ///< each as long as a multiple of kAlignment
  std::size_t buffer_bytes = 0;
};

/// Appends bytes to the buffer, aligned; the number of the view that holds them.
int add_view(GlbModel& model, std::vector<std::uint8_t> bytes, int target) {
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = model.buffer_bytes;
  view.byteLength = bytes.size();
  view.target = target;
  bytes.resize((bytes.size() + kAlignment - 1) / kAlignment * kAlignment, 0);
  model.buffer_bytes += bytes.size();
  model.parts.push_back(std::move(bytes));
  model.json.bufferViews.push_back(std::move(view));
  return static_cast<int>(model.json.bufferViews.size() - 1);
}

/// An accessor that is the only one of its view.
template <typename T>
int add_accessor(GlbModel& model,
                 const std::vector<T>& values,
                 int component_type,
                 int type,
                 int target = TINYGLTF_TARGET_ARRAY_BUFFER) {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(values.data());
  tinygltf::Accessor accessor;
  accessor.bufferView = add_view(model, {bytes, bytes + values.size() * sizeof(T)}, target);
  accessor.componentType = component_type;
  accessor.type = type;
  accessor.count = values.size();
  accessor.normalized = component_type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
  model.json.accessors.push_back(std::move(accessor));
  return static_cast<int>(model.json.accessors.size() - 1);
}

void set_bounds(tinygltf::Accessor& accessor, const std::vector<Eigen::Vector3f>& positions) {
  Eigen::Vector3f low = positions.front();
  Eigen::Vector3f high = positions.front();
  for (const Eigen::Vector3f& position : positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  const Eigen::Vector3d low_exact = low.cast<double>();
  const Eigen::Vector3d high_exact = high.cast<double>();
  accessor.minValues.assign(low_exact.begin(), low_exact.end());
  accessor.maxValues.assign(high_exact.begin(), high_exact.end());
}

void add_primitive(GlbModel& model, const Surface& surface, int material) {
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  primitive.material = material;
  const int positions =
      add_accessor(model, surface.positions, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
  set_bounds(model.json.accessors.back(), surface.positions);
  primitive.attributes["POSITION"] = positions;
  primitive.attributes["NORMAL"] =
      add_accessor(model, surface.normals, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
  if (!surface.uvs.empty()) {
    primitive.attributes["TEXCOORD_0"] =
        add_accessor(model, surface.uvs, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC2);
  }
  if (!surface.colors.empty()) {
    primitive.attributes["COLOR_0"] = add_accessor(
        model, surface.colors, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4);
  }
  primitive.indices = add_accessor(model,
                                   surface.corners,
                                   TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                                   TINYGLTF_TYPE_SCALAR,
                                   TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  model.json.meshes.front().primitives.push_back(std::move(primitive));
}

/// `texture` is -1 for none.
int add_material(GlbModel& model, std::string name, int texture) {
  tinygltf::Material material;
  material.name = std::move(name);
  material.doubleSided = true;  // a scan is open: its back is better seen than missing
  material.pbrMetallicRoughness.metallicFactor = 0.0;
  material.pbrMetallicRoughness.roughnessFactor = 1.0;
  material.pbrMetallicRoughness.baseColorTexture.index = texture;
  material.extensions[kUnlit] = tinygltf::Value(tinygltf::Value::Object());
  model.json.materials.push_back(std::move(material));
  return static_cast<int>(model.json.materials.size() - 1);
}

Result<int> add_texture(GlbModel& model,
                        const cv::Mat& page,
                        const PageEncoding& encoding,
                        const std::string& name) {
  TM_ASSIGN_OR_RETURN(std::vector<std::uint8_t> bytes, encode_page(page, encoding));
  tinygltf::Image image;
  image.name = name;
  image.mimeType = std::string(mime_type(encoding.format));
  image.bufferView = add_view(model, std::move(bytes), 0);
  model.json.images.push_back(std::move(image));
  if (model.json.samplers.empty()) {
    tinygltf::Sampler sampler;
    sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
    sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
    sampler.wrapS = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    model.json.samplers.push_back(std::move(sampler));
  }
  tinygltf::Texture texture;
  texture.sampler = 0;
  texture.source = static_cast<int>(model.json.images.size() - 1);
  model.json.textures.push_back(std::move(texture));
  return static_cast<int>(model.json.textures.size() - 1);
}

/// The matrix of a placement, column by column.
tinygltf::Value matrix_of(const ModelPlacement& placement) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topRows<3>() =
      placement.metres_per_unit.value_or(1.0) * placement.model_from_world.matrix();
  tinygltf::Value::Array numbers;
  for (const double value : matrix.reshaped()) {
    numbers.emplace_back(value + 0.0);
  }
  return tinygltf::Value(std::move(numbers));
}

/// One scene of one node of one mesh, without primitives.
GlbModel empty_model(const GlbOptions& options) {
  GlbModel result;
  tinygltf::Model& model = result.json;
  model.asset.version = "2.0";
  model.asset.generator = options.generator;
  tinygltf::Value::Object extras;
  extras["length_unit"] =
      tinygltf::Value(std::string(options.placement.metres_per_unit ? "metre" : "scene unit"));
  extras["model_from_world"] = matrix_of(options.placement);
  model.asset.extras = tinygltf::Value(std::move(extras));
  model.extensionsUsed = {kUnlit};
  model.meshes.emplace_back();
  model.meshes.front().name = options.mesh_name;
  tinygltf::Node node;
  node.mesh = 0;
  node.name = options.mesh_name;
  model.nodes.push_back(std::move(node));
  tinygltf::Scene scene;
  scene.nodes = {0};
  model.scenes.push_back(std::move(scene));
  model.defaultScene = 0;
  return result;
}

/// The JSON of a model, padded with blanks.
Result<std::string> json_chunk(const GlbModel& model) {
  std::ostringstream out;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&model.json, out, false, false)) {
    return fail(ErrorCode::kInternal, "tinygltf cannot write the model");
  }
  nlohmann::json json = nlohmann::json::parse(std::move(out).str(), nullptr, false);
  if (json.is_discarded()) {
    return fail(ErrorCode::kInternal, "tinygltf writes a model that is no JSON");
  }
  json["buffers"] = nlohmann::json::array({{{"byteLength", model.buffer_bytes}}});
  std::string chunk = json.dump();
  chunk.resize((chunk.size() + kAlignment - 1) / kAlignment * kAlignment, ' ');
  return chunk;
}

void write_chunk_head(std::uint32_t bytes, std::uint32_t type, ByteWriter& out) {
  out.value<std::uint32_t>(bytes);
  out.value<std::uint32_t>(type);
}

/// The container. Each part is freed as soon as it is in the file.
Result<std::string> to_bytes(GlbModel model) {
  if (model.buffer_bytes > kMostBufferBytes) {
    return fail(ErrorCode::kLimitExceeded,
                "the mesh and its pages take {} bytes, a GLB file holds at most {}",
                model.buffer_bytes,
                kMostBufferBytes);
  }
  TM_ASSIGN_OR_RETURN(const std::string json, json_chunk(model));
  const std::size_t file_bytes =
      kFileHeadBytes + 2 * kChunkHeadBytes + json.size() + model.buffer_bytes;
  ByteWriter out;
  out.reserve(file_bytes);
  out.text("glTF");
  out.value<std::uint32_t>(2);
  out.value<std::uint32_t>(static_cast<std::uint32_t>(file_bytes));
  write_chunk_head(static_cast<std::uint32_t>(json.size()), kJsonChunk, out);
  out.text(json);
  write_chunk_head(static_cast<std::uint32_t>(model.buffer_bytes), kBinaryChunk, out);
  for (std::vector<std::uint8_t>& part : model.parts) {
    out.text({reinterpret_cast<const char*>(part.data()), part.size()});
    part = {};
  }
  return std::move(out).take();
}

/// Splits vertices by texture coordinate: the copies of a vertex are a chain.
class VertexSplitter {
 public:
  explicit VertexSplitter(std::size_t vertex_count) : first_(vertex_count, kNone) {}

  /// The number of the copy of `vertex` with these coordinates; `is_new` when it did not exist.
  struct Copy {
    std::uint32_t number;
    bool is_new;
  };

  Copy copy_of(std::uint32_t vertex, const Eigen::Vector2f& uv) {
    for (std::uint32_t i = first_[vertex]; i != kNone; i = copies_[i].next) {
      if (copies_[i].uv == uv) {
        return {i, false};
      }
    }
    const auto number = static_cast<std::uint32_t>(copies_.size());
    copies_.push_back({vertex, uv, std::exchange(first_[vertex], number)});
    return {number, true};
  }

  /// Forgets all copies.
  void clear() {
    for (const Entry& entry : copies_) {
      first_[entry.vertex] = kNone;
    }
    copies_.clear();
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Entry {
    std::uint32_t vertex;
    Eigen::Vector2f uv;
    std::uint32_t next;
  };

  std::vector<std::uint32_t> first_;
  std::vector<Entry> copies_;
};

std::vector<std::vector<std::uint32_t>> faces_by_page(const TexturedMesh& textured) {
  std::vector<std::vector<std::uint32_t>> faces(textured.pages.size());
  for (std::uint32_t i = 0; i < textured.mesh.faces.size(); ++i) {
    if (has_extent(textured.mesh.faces[i])) {
      faces[textured.face_page[i]].push_back(i);
    }
  }
  return faces;
}

Surface page_surface(const TexturedMesh& textured,
                     const std::vector<std::uint32_t>& faces,
                     const std::vector<Eigen::Vector3f>& normals,
                     const ModelPlacement& placement,
                     VertexSplitter& splitter) {
  Surface surface;
  surface.corners.reserve(3 * faces.size());
  splitter.clear();
  for (const std::uint32_t face : faces) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = textured.mesh.faces[face][corner];
      const Eigen::Vector2f& uv = textured.face_uv[face][corner];
      const VertexSplitter::Copy copy = splitter.copy_of(vertex, uv);
      surface.corners.push_back(copy.number);
      if (copy.is_new) {
        surface.positions.push_back(placement.point(textured.mesh.positions[vertex]));
        surface.normals.push_back(placement.direction(normals[vertex]));
        surface.uvs.push_back(uv);
      }
    }
  }
  return surface;
}

/// IEC 61966-2-1, to 16 bits.
std::uint16_t linear_from_srgb(std::uint8_t value) {
  const double encoded = value / 255.0;
  const double linear =
      encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(linear * 65535.0));
}

Surface colored_surface(const TriangleMesh& mesh, const ModelPlacement& placement) {
  std::array<std::uint16_t, 256> linear{};
  for (std::size_t i = 0; i < linear.size(); ++i) {
    linear[i] = linear_from_srgb(static_cast<std::uint8_t>(i));
  }
  const std::vector<Eigen::Vector3f> normals = unit_normals(mesh);
  Surface surface;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    surface.positions.push_back(placement.point(mesh.positions[i]));
    surface.normals.push_back(placement.direction(normals[i]));
    if (!mesh.colors.empty()) {
      const std::array<std::uint8_t, 3>& rgb = mesh.colors[i];
      surface.colors.push_back({linear[rgb[0]], linear[rgb[1]], linear[rgb[2]], 65535});
    }
  }
  for (const std::array<std::uint32_t, 3>& face : mesh.faces) {
    if (has_extent(face)) {
      surface.corners.insert(surface.corners.end(), face.begin(), face.end());
    }
  }
  return surface;
}

}  // namespace

Result<std::string> write_glb(const TexturedMesh& textured, const GlbOptions& options) {
  TM_RETURN_IF_ERROR(options.placement.validate());
  TM_RETURN_IF_ERROR(check_mesh(textured));
  GlbModel model = empty_model(options);
  const std::vector<Eigen::Vector3f> normals = unit_normals(textured.mesh);
  const std::vector<std::vector<std::uint32_t>> faces = faces_by_page(textured);
  VertexSplitter splitter(textured.mesh.positions.size());
  for (std::size_t page = 0; page < faces.size(); ++page) {
    if (faces[page].empty()) {
      continue;
    }
    const std::string name = fmt::format("page_{}", page);
    TM_ASSIGN_OR_RETURN(const int texture,
                        add_texture(model, textured.pages[page], options.pages, name));
    const int material = add_material(model, name, texture);
    add_primitive(
        model, page_surface(textured, faces[page], normals, options.placement, splitter), material);
  }
  return to_bytes(std::move(model));
}

Result<std::string> write_glb(const TriangleMesh& mesh, const GlbOptions& options) {
  TM_RETURN_IF_ERROR(options.placement.validate());
  TM_RETURN_IF_ERROR(check_mesh(mesh));
  GlbModel model = empty_model(options);
  const int material = add_material(model, "surface", -1);
  add_primitive(model, colored_surface(mesh, options.placement), material);
  return to_bytes(std::move(model));
}

}  // namespace trigmesh
