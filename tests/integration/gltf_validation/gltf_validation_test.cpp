// What write_glb makes is judged by the validator of those who wrote the standard: no errors, no
// warnings.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/glb.hpp"
#include "tests/integration/run_program.hpp"
#include "tests/support/textured_globe.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

class GltfValidation : public test_support::ScratchTest {
 protected:
  /// What the validator prints about these bytes.
  std::string validate(const Result<std::string>& glb) {
    EXPECT_TRUE(glb.has_value()) << glb.error().message;
    EXPECT_TRUE(write_file_atomically(path("model.glb"), glb.value_or("")).has_value());
    const test_support::ProgramResult result =
        test_support::run_program({TRIGMESH_NODE, TRIGMESH_GLTF_VALIDATOR, path("model.glb")});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    return result.out;
  }
};

constexpr const char* kSpotless = ": 0 errors, 0 warnings, 0 infos, 0 hints; ";

TEST_F(GltfValidation, FindsNothingInATexturedMesh) {
  const std::string said = validate(write_glb(test_support::make_textured_globe()));
  EXPECT_THAT(said, HasSubstr(kSpotless));
  EXPECT_THAT(said, HasSubstr("2 primitives, 2 materials, "));
  EXPECT_THAT(said, HasSubstr(" 2208 triangles"));
}

TEST_F(GltfValidation, FindsNothingInPngPagesAndMetres) {
  GlbOptions options;
  options.pages.format = ImageFormat::kPng;
  options.placement.metres_per_unit = 0.123;
  options.placement.model_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  options.mesh_name = "\"quoted\" \xC3\xA9";
  EXPECT_THAT(validate(write_glb(test_support::make_textured_globe(), options)),
              HasSubstr(kSpotless));
}

TEST_F(GltfValidation, FindsNothingInASinglePageOfOddSize) {
  TexturedMesh globe = test_support::make_textured_globe({.page_size_px = 64});
  std::ranges::fill(globe.face_page, std::uint16_t{0});
  globe.pages.pop_back();
  EXPECT_THAT(validate(write_glb(globe)), HasSubstr(kSpotless));
}

TEST_F(GltfValidation, FindsNothingInAMeshWithColours) {
  TriangleMesh mesh = test_support::make_textured_globe().mesh;
  mesh.colors.assign(mesh.positions.size(), {200, 100, 50});
  EXPECT_THAT(validate(write_glb(mesh)), HasSubstr(kSpotless));
}

TEST_F(GltfValidation, FindsNothingInABareMeshWithoutNormals) {
  TriangleMesh mesh = test_support::make_textured_globe().mesh;
  mesh.normals.clear();
  EXPECT_THAT(validate(write_glb(mesh)), HasSubstr(kSpotless));
}

}  // namespace
}  // namespace trigmesh
