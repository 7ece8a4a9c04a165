#include "sfm/exchange/glb.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include <tiny_gltf.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/textured_globe.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

/// Read back by tinygltf, pictures decoded by the library inside it.
tinygltf::Model parse(const std::string& bytes) {
  tinygltf::TinyGLTF reader;
  tinygltf::Model model;
  std::string error;
  std::string warning;
  EXPECT_TRUE(reader.LoadBinaryFromMemory(&model,
                                          &error,
                                          &warning,
                                          reinterpret_cast<const unsigned char*>(bytes.data()),
                                          static_cast<unsigned int>(bytes.size())))
      << error;
  EXPECT_EQ(warning, "");
  return model;
}

template <typename T>
std::vector<T> values_of(const tinygltf::Model& model, int accessor_number) {
  const tinygltf::Accessor& accessor =
      model.accessors.at(static_cast<std::size_t>(accessor_number));
  const tinygltf::BufferView& view =
      model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
  std::vector<T> values(accessor.count);
  EXPECT_EQ(view.byteLength, values.size() * sizeof(T));
  std::memcpy(values.data(), model.buffers.at(0).data.data() + view.byteOffset, view.byteLength);
  return values;
}

using Vector3s = std::vector<std::array<float, 3>>;
using Vector2s = std::vector<std::array<float, 2>>;

Vector3s positions_of(const tinygltf::Model& model, std::size_t primitive) {
  return values_of<std::array<float, 3>>(
      model, model.meshes.at(0).primitives.at(primitive).attributes.at("POSITION"));
}

TriangleMesh one_triangle() {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 2}, {1, 0, 2}, {0, -1, 2}};
  mesh.faces = {{0, 1, 2}};
  return mesh;
}

TexturedMesh textured_triangle() {
  TexturedMesh textured;
  textured.mesh = one_triangle();
  textured.pages = {cv::Mat(4, 4, CV_8UC3, cv::Scalar(200, 100, 50))};
  textured.face_page = {0};
  textured.face_uv = {{Eigen::Vector2f(0, 1), Eigen::Vector2f(1, 1), Eigen::Vector2f(0, 0)}};
  return textured;
}

TEST(Glb, HasOnePrimitiveMaterialAndPictureAPage) {
  const auto bytes = write_glb(test_support::make_textured_globe());
  ASSERT_TRUE(bytes.has_value()) << bytes.error().message;
  EXPECT_EQ(bytes->size() % 4, 0U);
  const tinygltf::Model model = parse(*bytes);
  ASSERT_EQ(model.meshes.size(), 1U);
  EXPECT_EQ(model.meshes[0].primitives.size(), 2U);
  EXPECT_EQ(model.materials.size(), 2U);
  ASSERT_EQ(model.images.size(), 2U);
  EXPECT_EQ(model.images[0].width, 256);
  EXPECT_EQ(model.images[0].mimeType, "image/jpeg");
  EXPECT_THAT(model.extensionsUsed, ::testing::ElementsAre("KHR_materials_unlit"));
  EXPECT_TRUE(model.materials[0].extensions.contains("KHR_materials_unlit"));
  EXPECT_EQ(model.materials[1].pbrMetallicRoughness.metallicFactor, 0.0);
  EXPECT_EQ(model.materials[1].pbrMetallicRoughness.baseColorTexture.index, 1);
}

TEST(Glb, KeepsEveryFaceWithItsPlaceAndTexture) {
  const TexturedMesh globe = test_support::make_textured_globe();
  const auto bytes = write_glb(globe);
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = parse(*bytes);
  std::array<std::vector<std::uint32_t>, 2> corners;
  std::array<Vector3s, 2> positions;
  std::array<Vector2s, 2> uvs;
  for (std::size_t page = 0; page < 2; ++page) {
    const tinygltf::Primitive& primitive = model.meshes[0].primitives.at(page);
    corners[page] = values_of<std::uint32_t>(model, primitive.indices);
    positions[page] = positions_of(model, page);
    uvs[page] = values_of<std::array<float, 2>>(model, primitive.attributes.at("TEXCOORD_0"));
  }
  std::array<std::size_t, 2> next{};
  for (std::size_t face = 0; face < globe.mesh.faces.size(); ++face) {
    const std::size_t page = globe.face_page[face];
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t at = corners[page].at(next[page]++);
      const Eigen::Vector3f& p = globe.mesh.positions[globe.mesh.faces[face][corner]];
      const Eigen::Vector2f& uv = globe.face_uv[face][corner];
      EXPECT_EQ(positions[page].at(at), (std::array{p.x(), -p.y(), -p.z()}));
      EXPECT_EQ(uvs[page].at(at), (std::array{uv.x(), uv.y()}));
    }
  }
  EXPECT_EQ(next[0] + next[1], 3 * globe.mesh.faces.size());
}

TEST(Glb, SplitsVerticesOnlyWhereTheTextureIsCut) {
  const auto bytes = write_glb(test_support::make_textured_globe({.rings = 4, .sectors = 6}));
  ASSERT_TRUE(bytes.has_value());
  // Upper half: a pole with 6 coordinates (the seam belongs to the last sector), and two rings of
  // 6 + 1.
  EXPECT_EQ(positions_of(parse(*bytes), 0).size(), 6U + 2U * 7U);
}

TEST(Glb, HasUnitNormalsThatPointOutwards) {
  TexturedMesh globe = test_support::make_textured_globe();
  globe.mesh.normals.clear();
  const auto bytes = write_glb(globe);
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = parse(*bytes);
  const Vector3s positions = positions_of(model, 0);
  const auto normals =
      values_of<std::array<float, 3>>(model, model.meshes[0].primitives[0].attributes.at("NORMAL"));
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Eigen::Vector3f normal(normals[i].data());
    const Eigen::Vector3f outwards =
        Eigen::Vector3f(positions[i].data()) - Eigen::Vector3f(0, 0, -3);
    EXPECT_NEAR(normal.norm(), 1.0F, 1e-6F);
    EXPECT_GT(normal.dot(outwards), 0.9F);
  }
}

TEST(Glb, TellsBoundsOfWhatIsInTheFile) {
  const auto bytes = write_glb(textured_triangle());
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = parse(*bytes);
  const auto position =
      static_cast<std::size_t>(model.meshes[0].primitives[0].attributes.at("POSITION"));
  EXPECT_EQ(model.accessors[position].minValues, (std::vector<double>{0, 0, -2}));
  EXPECT_EQ(model.accessors[position].maxValues, (std::vector<double>{1, 1, -2}));
}

TEST(Glb, TurnsTheWorldUprightAndIntoMetres) {
  GlbOptions options;
  options.placement.metres_per_unit = 0.5;
  options.placement.model_from_world = {.translation = {10, 0, 0}};
  const auto bytes = write_glb(textured_triangle(), options);
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = parse(*bytes);
  EXPECT_EQ(positions_of(model, 0).at(1), (std::array{5.5F, 0.0F, 1.0F}));
  EXPECT_EQ(model.asset.extras.Get("length_unit").Get<std::string>(), "metre");
  const tinygltf::Value& matrix = model.asset.extras.Get("model_from_world");
  ASSERT_EQ(matrix.ArrayLen(), 16U);
  EXPECT_EQ(matrix.Get(0).GetNumberAsDouble(), 0.5);
  EXPECT_EQ(matrix.Get(12).GetNumberAsDouble(), 5.0);
}

TEST(Glb, SaysThatLengthsHaveNoUnit) {
  const auto bytes = write_glb(textured_triangle());
  ASSERT_TRUE(bytes.has_value());
  EXPECT_EQ(parse(*bytes).asset.extras.Get("length_unit").Get<std::string>(), "scene unit");
}

TEST(Glb, KeepsThePixelsOfPngPages) {
  GlbOptions options;
  options.pages.format = ImageFormat::kPng;
  const auto bytes = write_glb(test_support::make_textured_globe(), options);
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = parse(*bytes);
  EXPECT_EQ(model.images[1].mimeType, "image/png");
  const cv::Mat page = test_support::make_textured_globe().pages[1];
  ASSERT_EQ(model.images[1].component, 4);
  for (int y = 0; y < page.rows; ++y) {
    for (int x = 0; x < page.cols; ++x) {
      const std::size_t at = 4 * static_cast<std::size_t>(y * page.cols + x);
      for (int channel = 0; channel < 3; ++channel) {
        ASSERT_EQ(model.images[1].image.at(at + static_cast<std::size_t>(channel)),
                  page.at<cv::Vec3b>(y, x)[channel]);
      }
    }
  }
}

TEST(Glb, LeavesOutPagesWithoutFacesAndFacesWithoutExtent) {
  TexturedMesh textured = textured_triangle();
  textured.pages.push_back(textured.pages[0]);
  textured.mesh.faces.push_back({0, 0, 1});
  textured.face_page.push_back(1);
  textured.face_uv.push_back(textured.face_uv[0]);
  const auto bytes = write_glb(textured);
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = parse(*bytes);
  EXPECT_EQ(model.images.size(), 1U);
  EXPECT_EQ(model.meshes[0].primitives.size(), 1U);
}

TEST(Glb, WritesVertexColoursAsLinearLight) {
  TriangleMesh mesh = one_triangle();
  mesh.colors = {{0, 255, 188}, {1, 2, 3}, {4, 5, 6}};
  const auto bytes = write_glb(mesh);
  ASSERT_TRUE(bytes.has_value());
  const tinygltf::Model model = parse(*bytes);
  const auto colors = values_of<std::array<std::uint16_t, 4>>(
      model, model.meshes[0].primitives[0].attributes.at("COLOR_0"));
  EXPECT_EQ(colors[0][0], 0);
  EXPECT_EQ(colors[0][1], 65535);
  EXPECT_NEAR(colors[0][2] / 65535.0, 0.503, 0.001) << "188 of sRGB is half of the light";
  EXPECT_EQ(colors[0][3], 65535);
  EXPECT_TRUE(model.images.empty());
}

TEST(Glb, IsTheSameForTheSameMesh) {
  EXPECT_EQ(write_glb(test_support::make_textured_globe()).value(),
            write_glb(test_support::make_textured_globe()).value());
}

TEST(Glb, RefusesMeshesThatContradictThemselves) {
  std::vector<TexturedMesh> wrong(8, textured_triangle());
  wrong[0].mesh.faces = {{0, 1, 3}};
  wrong[1].mesh.faces.clear();
  wrong[1].face_page.clear();
  wrong[1].face_uv.clear();
  wrong[2].face_page = {1};
  wrong[3].face_uv.clear();
  wrong[4].mesh.positions[0].x() = std::nanf("");
  wrong[5].face_uv[0][0].x() = std::nanf("");
  wrong[6].pages[0] = cv::Mat(4, 4, CV_8UC1);
  wrong[7].mesh.normals.resize(2);
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    const auto bytes = write_glb(wrong[i]);
    ASSERT_FALSE(bytes.has_value()) << i;
    EXPECT_EQ(bytes.error().code, ErrorCode::kInvalidArgument) << i;
  }
}

TEST(Glb, StandsUprightOffAWorldWhoseZIsUp) {
  GlbOptions options;
  options.placement.model_from_world = y_up_from_z_up();
  EXPECT_LT(
      (options.placement.direction(Eigen::Vector3f::UnitZ()) - Eigen::Vector3f::UnitY()).norm(),
      1e-6F);
  EXPECT_LT(
      (options.placement.direction(Eigen::Vector3f::UnitX()) - Eigen::Vector3f::UnitX()).norm(),
      1e-6F);
}

TEST(Glb, RefusesAScaleThatIsNone) {
  GlbOptions options;
  options.placement.metres_per_unit = 0.0;
  const auto bytes = write_glb(one_triangle(), options);
  ASSERT_FALSE(bytes.has_value());
  EXPECT_THAT(bytes.error().message, HasSubstr("metres_per_unit"));
}

}  // namespace
}  // namespace trigmesh
