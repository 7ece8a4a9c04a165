#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/model_folder.hpp"
#include "tests/integration/run_program.hpp"
#include "tests/support/synthetic_scene.hpp"

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Scene example_scene(CameraModel model, const std::array<double, 4>& distortion) {
  SyntheticSceneOptions options;
  options.views = 6;
  options.points = 150;
  options.noise_px = 0.3;
  options.clutter_ratio = 0.1;
  options.camera_groups = 2;
  options.camera.model = model;
  options.camera.fy_px = options.camera.fx_px;
  options.camera.distortion = distortion;
  Scene scene = make_synthetic_scene(options).truth;
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    scene.landmarks[i].color_rgb = {static_cast<std::uint8_t>(i % 251), 7, 200};
  }
  return scene;
}

Scene pinhole_scene() {
  return example_scene(CameraModel::kPinhole, {});
}

Scene radial_scene() {
  return example_scene(CameraModel::kRadial, {-0.1, 0.02, 0.0, 0.0});
}

Scene brown_scene() {
  return example_scene(CameraModel::kBrownConrady, {-0.1, 0.02, 1e-3, -2e-3});
}

Scene fisheye_scene() {
  return example_scene(CameraModel::kKannalaBrandt, {0.02, -3e-3, 4e-4, -1e-4});
}

class Export : public ScratchTest {
 protected:
  void export_to(const Scene& scene, const std::string& format) {
    ASSERT_TRUE(write_text_model(scene, path("out/model/sparse")).has_value());
    const ProgramResult result =
        run_trigmesh({"export", path("out"), "--format", format, "--output", path("exported")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("6 images"));
    EXPECT_THAT(result.err, IsEmpty());
  }

  /// Projections of an independent reader stay within `limit_px` of those by the model's own
  /// cameras.
  void expect_same_projections(const std::string& format, double limit_px) {
    const ProgramResult result =
        run_program({"/usr/bin/python3",
                     source_path("tests/integration/project_exported.py").string(),
                     format,
                     path("exported"),
                     path("out/model/sparse")});
    if (result.exit_code != 0 && result.err.find("No module named 'numpy'") != std::string::npos) {
      GTEST_SKIP() << "python3-numpy is not installed";
    }
    ASSERT_EQ(result.exit_code, 0) << result.err;
    int count = 0;
    double worst_px = 0.0;
    ASSERT_EQ(std::sscanf(result.out.c_str(), "%d %lf", &count, &worst_px), 2) << result.out;
    EXPECT_GT(count, 100);
    EXPECT_LT(worst_px, limit_px);
  }
};

constexpr double kDoublePrecision_px = 1e-9;
constexpr double kFloatPrecision_px = 1e-3;  // points are floats in the file

TEST_F(Export, ColmapBinaryProjectsEveryLensAlike) {
  for (const Scene& scene : {pinhole_scene(), radial_scene(), brown_scene(), fisheye_scene()}) {
    export_to(scene, "colmap-binary");
    expect_same_projections("colmap-binary", kDoublePrecision_px);
  }
}

TEST_F(Export, NerfstudioProjectsEveryLensAlike) {
  for (const Scene& scene : {pinhole_scene(), radial_scene(), brown_scene(), fisheye_scene()}) {
    export_to(scene, "nerfstudio");
    expect_same_projections("nerfstudio", kFloatPrecision_px);
  }
}

TEST_F(Export, OpenMvsProjectsAlike) {
  export_to(pinhole_scene(), "openmvs");
  expect_same_projections("openmvs", kFloatPrecision_px);
}

TEST_F(Export, BundlerProjectsAlike) {
  export_to(radial_scene(), "bundler");
  expect_same_projections("bundler", kDoublePrecision_px);
}

TEST_F(Export, ColmapTextIsTheModelItself) {
  export_to(brown_scene(), "colmap-text");
  for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
    EXPECT_EQ(*read_file(path(std::string("exported/") + name), kMaxModelFileBytes),
              *read_file(path(std::string("out/model/sparse/") + name), kMaxModelFileBytes));
  }
}

TEST_F(Export, ColmapItselfReadsBothOfItsFormats) {
  if (!find_program("colmap")) {
    GTEST_SKIP() << "colmap is not installed";
  }
  const Scene scene = brown_scene();
  export_to(scene, "colmap-binary");
  for (const std::string& model : {path("out/model/sparse"), path("exported")}) {
    const ProgramResult analysis = run_program({"colmap", "model_analyzer", "--path", model});
    ASSERT_EQ(analysis.exit_code, 0) << analysis.err;
    const std::string report = analysis.out + analysis.err;
    EXPECT_THAT(report, HasSubstr("Registered images: 6"));
    EXPECT_THAT(report, HasSubstr("Points: " + std::to_string(scene.landmarks.size())));

    fs::create_directories(folder_ / "converted");
    const ProgramResult conversion = run_program({"colmap",
                                                  "model_converter",
                                                  "--input_path",
                                                  model,
                                                  "--output_path",
                                                  path("converted"),
                                                  "--output_type",
                                                  "BIN"});
    ASSERT_EQ(conversion.exit_code, 0) << conversion.err;
    const auto read = read_model(folder_ / "converted");
    ASSERT_TRUE(read.has_value()) << read.error().message;
    ASSERT_EQ(read->landmarks.size(), scene.landmarks.size());
    for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
      EXPECT_EQ(read->landmarks[i].track, scene.landmarks[i].track);
    }
    for (std::size_t i = 0; i < scene.views.size(); ++i) {
      EXPECT_EQ(read->views[i].keypoints_px, scene.views[i].keypoints_px);
      EXPECT_LT((read->views[i].cam_from_world->matrix() - scene.views[i].cam_from_world->matrix())
                    .norm(),
                1e-12);
    }
  }
}

TEST_F(Export, NamesThePhotographsAsSeenFromTheOutput) {
  fs::create_directories(folder_ / "photos");
  ASSERT_TRUE(write_text_model(pinhole_scene(), path("out/model/sparse")).has_value());
  const ProgramResult result = run_trigmesh({"export",
                                             path("out"),
                                             "--format",
                                             "bundler",
                                             "--output",
                                             path("deep/exported"),
                                             "--images",
                                             path("photos")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(*read_file(path("deep/exported/list.txt"), kMaxModelFileBytes),
              ::testing::StartsWith("../../photos/component0/view000.jpg\n"));
}

TEST_F(Export, RefusesWhatTheFormatCannotSay) {
  ASSERT_TRUE(write_text_model(brown_scene(), path("out")).has_value());
  for (const std::string format : {"openmvs", "bundler"}) {
    const ProgramResult result =
        run_trigmesh({"export", path("out"), "--format", format, "--output", path("exported")});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr("trigmesh: camera 1 has"));
  }
}

TEST_F(Export, SaysWhatIsWrongWithItsInputAndOutput) {
  const auto convert = [&](const std::string& model, const std::string& output) {
    return run_trigmesh({"export", model, "--format", "colmap-binary", "--output", output});
  };
  EXPECT_EQ(convert(path("missing"), path("exported")).exit_code, 3);

  ASSERT_TRUE(write_text_model(pinhole_scene(), path("out")).has_value());
  ASSERT_TRUE(write_file_atomically(path("file"), "x").has_value());
  const ProgramResult blocked = convert(path("out"), path("file"));
  EXPECT_EQ(blocked.exit_code, 5);
  EXPECT_THAT(blocked.err, HasSubstr(path("file")));

  ASSERT_TRUE(write_file_atomically(path("out/images.txt"), "1 2 3\n").has_value());
  const ProgramResult damaged = convert(path("out"), path("exported"));
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.err, HasSubstr("images.txt, line 1: a quaternion is missing"));
  EXPECT_FALSE(fs::exists(path("exported")));
}

TEST_F(Export, SaysThatTheDiskIsFullAndLeavesNoHalfFile) {
  // A tiny file system in a mount namespace of its own; not every machine allows that to a user.
  ASSERT_TRUE(write_text_model(pinhole_scene(), path("out")).has_value());
  fs::create_directories(folder_ / "disk");
  const std::string script =
      "mount -t tmpfs -o size=16k none \"$1\" 2>/dev/null || exit 99; shift; \"$@\"; code=$?; "
      "ls -A \"$MOUNTED\"; exit $code";
  ProgramResult result = run_program({"env",
                                      "MOUNTED=" + path("disk"),
                                      "unshare",
                                      "--map-root-user",
                                      "--mount",
                                      "sh",
                                      "-c",
                                      script,
                                      "sh",
                                      path("disk"),
                                      program_path(),
                                      "export",
                                      path("out"),
                                      "--format",
                                      "colmap-binary",
                                      "--output",
                                      path("disk")});
  if (result.exit_code == 99 || result.exit_code == 127 ||
      result.err.find("unshare") != std::string::npos) {
    GTEST_SKIP() << "this user may not mount a file system: " << result.err;
  }
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_THAT(result.err, HasSubstr("No space left on device"));
  EXPECT_THAT(result.out, ::testing::Not(HasSubstr(".part")));
}

}  // namespace
}  // namespace trigmesh::test_support
