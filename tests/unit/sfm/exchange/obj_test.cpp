#include "sfm/exchange/obj.hpp"

#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/image_codec.hpp"
#include "tests/support/textured_globe.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> names_of(const std::vector<NamedFile>& files) {
  std::vector<std::string> names;
  for (const NamedFile& file : files) {
    names.push_back(file.name);
  }
  return names;
}

/// What an OBJ says, read by its published layout.
struct ParsedObj {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
  std::vector<Eigen::Vector2f> coordinates;
  std::vector<std::array<std::array<std::size_t, 3>, 3>> faces;  ///< v/vt/vn from 1
  std::vector<std::string> materials;                            ///< per face
};

ParsedObj parse(const std::string& text) {
  ParsedObj obj;
  std::istringstream lines(text);
  std::string line;
  std::string material;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    Eigen::Vector3f v = Eigen::Vector3f::Zero();
    if (keyword == "v" || keyword == "vn") {
      words >> v.x() >> v.y() >> v.z();
      (keyword == "v" ? obj.positions : obj.normals).push_back(v);
    } else if (keyword == "vt") {
      words >> v.x() >> v.y();
      obj.coordinates.emplace_back(v.head<2>());
    } else if (keyword == "usemtl") {
      words >> material;
    } else if (keyword == "f") {
      std::array<std::array<std::size_t, 3>, 3> face{};
      char slash = 0;
      for (auto& corner : face) {
        words >> corner[0] >> slash >> corner[1] >> slash >> corner[2];
      }
      obj.faces.push_back(face);
      obj.materials.push_back(material);
    }
    EXPECT_FALSE(words.fail()) << line;
  }
  return obj;
}

TEST(Obj, IsASetOfFilesThatNameEachOther) {
  const auto files = write_obj(test_support::make_textured_globe());
  ASSERT_TRUE(files.has_value()) << files.error().message;
  EXPECT_THAT(names_of(*files),
              ElementsAre("textured_0.jpg", "textured_1.jpg", "textured.mtl", "textured.obj"));
  EXPECT_THAT(files->at(3).bytes, HasSubstr("mtllib textured.mtl\n"));
  EXPECT_THAT(files->at(2).bytes, HasSubstr("newmtl page_1\n"));
  EXPECT_THAT(files->at(2).bytes, HasSubstr("map_Kd textured_1.jpg\n"));
}

TEST(Obj, KeepsEveryFaceWithItsPlaceAndTexture) {
  const TexturedMesh globe = test_support::make_textured_globe();
  const auto files = write_obj(globe);
  ASSERT_TRUE(files.has_value());
  const ParsedObj obj = parse(files->back().bytes);
  ASSERT_EQ(obj.faces.size(), globe.mesh.faces.size());
  EXPECT_EQ(obj.positions.size(), globe.mesh.positions.size());
  for (std::size_t i = 0; i < obj.faces.size(); ++i) {  // the globe is in the order of its pages
    EXPECT_EQ(obj.materials[i], globe.face_page[i] == 0 ? "page_0" : "page_1");
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto& [v, vt, vn] = obj.faces[i][corner];
      const Eigen::Vector3f p = globe.mesh.positions[globe.mesh.faces[i][corner]];
      const Eigen::Vector2f uv = globe.face_uv[i][corner];
      EXPECT_EQ(obj.positions.at(v - 1), Eigen::Vector3f(p.x(), -p.y(), -p.z()));
      EXPECT_EQ(obj.coordinates.at(vt - 1), Eigen::Vector2f(uv.x(), 1.0F - uv.y()));
      EXPECT_NEAR(obj.normals.at(vn - 1).norm(), 1.0F, 1e-6F);
    }
  }
}

TEST(Obj, SharesEqualCoordinates) {
  const auto files = write_obj(test_support::make_textured_globe({.rings = 4, .sectors = 6}));
  ASSERT_TRUE(files.has_value());
  // Each half has three rows of coordinates and seven columns, but no corner at the end of a pole's
  // row; both halves use the same numbers, the lower one lacks a pole coordinate at the other end.
  EXPECT_LE(parse(files->back().bytes).coordinates.size(), 3U * 7U);
}

TEST(Obj, StoresPagesAsPngWhenAsked) {
  ObjOptions options;
  options.pages.format = ImageFormat::kPng;
  options.stem = "model-1";
  TexturedMesh globe = test_support::make_textured_globe();
  globe.pages.pop_back();
  std::ranges::fill(globe.face_page, std::uint16_t{0});
  const auto files = write_obj(globe, options);
  ASSERT_TRUE(files.has_value());
  EXPECT_THAT(names_of(*files), ElementsAre("model-1.png", "model-1.mtl", "model-1.obj"));
  const std::string& png = files->front().bytes;
  const auto decoded =
      decode_image({reinterpret_cast<const std::uint8_t*>(png.data()), png.size()}, {});
  ASSERT_TRUE(decoded.has_value());
  EXPECT_EQ(cv::Mat(decoded->rgb).at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
}

TEST(Obj, RefusesNamesThatLeaveTheFolder) {
  for (const char* stem : {"", "../x", "a b", "a.b", "a/b", "-\n"}) {
    ObjOptions options;
    options.stem = stem;
    const auto files = write_obj(test_support::make_textured_globe(), options);
    ASSERT_FALSE(files.has_value()) << stem;
    EXPECT_EQ(files.error().code, ErrorCode::kInvalidArgument);
  }
}

TEST(Obj, IsTheSameForTheSameMesh) {
  EXPECT_EQ(write_obj(test_support::make_textured_globe()).value().back().bytes,
            write_obj(test_support::make_textured_globe()).value().back().bytes);
}

}  // namespace
}  // namespace trigmesh
