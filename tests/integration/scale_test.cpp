// A model in metres off the marker card of the demo recording, whose true poses are known.

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sfm/exchange/model_folder.hpp"
#include "sfm/geometry/similarity.hpp"
#include "tests/integration/run_program.hpp"

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::chrono::seconds kTimeLimit{200};
constexpr double kDegPerRad = 57.29577951308232;

class Scale : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    take_demo_frames(4);
  }

  /// Every `step`-th frame of the demo recording.
  void take_demo_frames(std::size_t step) const {
    fs::remove_all(path("photos"));
    fs::create_directories(path("photos"));
    std::vector<fs::path> frames;
    for (const auto& entry : fs::directory_iterator(demo() / "images")) {
      frames.push_back(entry.path());
    }
    std::sort(frames.begin(), frames.end());
    for (std::size_t i = 0; i < frames.size(); i += step) {
      fs::copy_file(frames[i], fs::path(path("photos")) / frames[i].filename());
    }
  }

  [[nodiscard]] static fs::path demo() { return source_path("tools/demo/courtyard"); }

  [[nodiscard]] ProgramResult run(const std::vector<std::string>& more,
                                  const std::string& output = "out") const {
    std::vector<std::string> all{"reconstruct",
                                 path("photos"),
                                 "--output",
                                 path(output),
                                 "--no-upsample",
                                 "--quiet",
                                 "--camera",
                                 (demo() / "gt/cameras.txt").string()};
    all.insert(all.end(), more.begin(), more.end());
    return run_trigmesh(all, kTimeLimit);
  }

  [[nodiscard]] ProgramResult run_sparse(std::vector<std::string> more,
                                         const std::string& output = "out") const {
    more.insert(more.end(), {"--stop-after", "sparse"});
    return run(more, output);
  }

  [[nodiscard]] nlohmann::json report(const std::string& output = "out") const {
    return nlohmann::json::parse(contents(path(output + "/model/report.json")));
  }

  /// The similarity that carries the true camera centres to those of the model.
  [[nodiscard]] Sim3 model_from_truth() const {
    std::map<std::string, Eigen::Vector3d> truth;
    const auto poses = read_model_poses(demo() / "gt");
    EXPECT_TRUE(poses.has_value());
    for (const NamedPose& pose : *poses) {
      truth[pose.name] = camera_center(pose.cam_from_world);
    }
    const auto scene = read_model(path("out"));
    EXPECT_TRUE(scene.has_value());
    std::vector<Eigen::Vector3d> in_truth;
    std::vector<Eigen::Vector3d> in_model;
    for (const View& view : scene->views) {
      if (view.cam_from_world) {
        in_truth.push_back(truth.at(view.name));
        in_model.push_back(camera_center(*view.cam_from_world));
      }
    }
    return align_points(in_truth, in_model, ScaleMode::kEstimated).b_from_a;
  }
};

TEST_F(Scale, IsRightWithinHalfAPercentAndThreeStandardDeviations) {
  const ProgramResult result = run_sparse({"--marker-side", "100mm", "--up", "card"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("Metric: lengths are in metres"));
  const Sim3 model_from_truth = this->model_from_truth();
  const auto scale = report()["scale"][0];
  EXPECT_NEAR(model_from_truth.scale, 1.0, 0.005);
  EXPECT_NEAR(model_from_truth.scale, 1.0, 3.0 * scale["sd_ratio"].get<double>());
  const Eigen::Vector3d up = model_from_truth.rotation * Eigen::Vector3d::UnitZ();
  EXPECT_LT(kDegPerRad * std::acos(std::min(1.0, up.z())), 5.0 * scale["up_sd_deg"].get<double>());
  EXPECT_EQ(scale["unit"], "metre");
  EXPECT_EQ(scale["lengths"].size(), 4U);
  EXPECT_EQ(report()["metres_per_unit"], 1.0);
}

TEST_F(Scale, TellsTheMarkerWithAWrongSideAndLeavesTheModelUpToScale) {
  ASSERT_EQ(run_sparse({}, "plain").exit_code, 0);
  const ProgramResult result = run_sparse({"--marker-side", "0.1", "--marker-side", "3=12cm"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("has no scale"));
  EXPECT_THAT(result.err, HasSubstr("by marker 3 (0.12 m) one unit is"));
  EXPECT_THAT(result.out, HasSubstr("error: the model has no scale"));
  EXPECT_EQ(contents(path("out/model/sparse/images.txt")),
            contents(path("plain/model/sparse/images.txt")));
  EXPECT_EQ(report()["scale"][0]["outcome"], "disagreement");
  EXPECT_EQ(report()["notes"][0]["severity"], "error");
  EXPECT_FALSE(report("plain").contains("scale"));
  EXPECT_THAT(report("plain")["units"].get<std::string>(), HasSubstr("Up to scale"));
}

TEST_F(Scale, TellsWhenAllSidesAreWrongAndADistanceIsRight) {
  const ProgramResult result =
      run_sparse({"--marker-side", "0.11", "--known-distance", "0-1=16cm"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("by markers 0 and 1 (0.16 m) one unit is"));
  EXPECT_EQ(run_sparse({"--marker-side", "0.1", "--known-distance", "0-1=16cm"}).exit_code, 0);
  EXPECT_EQ(report()["scale"][0]["lengths"].size(), 5U);
}

TEST_F(Scale, SaysWhenNoMarkerIsThere) {
  const ProgramResult result =
      run_sparse({"--marker-side", "0.1", "--marker-dictionary", "6x6_50"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("no registered image shows a marker"));
  EXPECT_EQ(report()["scale"][0]["unit"], "arbitrary");
}

TEST_F(Scale, GoesThroughToTheMeshAndStaysWhenItIsMadeAgain) {
  const std::vector<std::string> quick{"--preset", "preview", "--texture-size", "1024"};
  std::vector<std::string> arguments{"--marker-side", "0.1", "--up", "card", "--threads", "1"};
  arguments.insert(arguments.end(), quick.begin(), quick.end());
  ASSERT_EQ(run(arguments).exit_code, 0);
  const std::string glb = contents(path("out/model/textured.glb"));
  EXPECT_THAT(glb, HasSubstr("\"metre\""));
  EXPECT_THAT(contents(path("out/model/textured.obj")), HasSubstr("metres"));
  // Of the two threads nothing is seen.
  arguments[5] = "2";
  ASSERT_EQ(run(arguments, "again").exit_code, 0);
  EXPECT_EQ(all_files(path("again/model")), all_files(path("out/model")));

  std::vector<std::string> texture{"texture", path("out"), "--images", path("photos"), "--quiet"};
  texture.insert(texture.end(), quick.begin(), quick.end());
  const ProgramResult again = run_trigmesh(texture, kTimeLimit);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(report()["units"].get<std::string>(), HasSubstr("Metric"));
  EXPECT_EQ(report()["scale"], report("again")["scale"]);
  EXPECT_THAT(contents(path("out/model/textured.glb")), HasSubstr("\"metre\""));
}

TEST_F(Scale, AnotherSideLeavesNothingOfTheOldOneBehind) {
  take_demo_frames(8);
  const auto dense = [&](const std::string& side, const std::string& output) {
    return run({"--marker-side", side, "--depth-size", "64", "--stop-after", "dense"}, output);
  };
  ASSERT_EQ(dense("0.1", "out").exit_code, 0);
  ASSERT_TRUE(fs::exists(path("out/work"))) << "depth maps stay after this stage";
  ASSERT_EQ(dense("0.2", "out").exit_code, 0);
  ASSERT_EQ(dense("0.2", "fresh").exit_code, 0);
  EXPECT_EQ(all_files(path("out/model")), all_files(path("fresh/model")));
}

TEST_F(Scale, RefusesLengthsThatCannotBe) {
  const std::vector<std::vector<std::string>> wrong{
      {"--marker-side", "25"},
      {"--marker-side", "0"},
      {"--marker-side", "wide"},
      {"--marker-side", "x=0.1"},
      {"--marker-side", "50=0.1"},
      {"--marker-side", "0.1", "--marker-side", "0.2"},
      {"--marker-side", "1=1cm", "--marker-side", "1=1cm"},
      {"--marker-side", "1=1cm", "--marker-dictionary", "7x7_50"},
      {"--known-distance", "0=1"},
      {"--known-distance", "0-0=1m"},
      {"--known-distance", "0-1"},
      {"--known-distance", "0-1=1", "--known-distance", "1-0=1"},
      {"--up", "card"},
      {"--up", "sky"}};
  for (const std::vector<std::string>& arguments : wrong) {
    const ProgramResult result = run_sparse(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments[0] << " " << arguments[1] << ": " << result.err;
    EXPECT_FALSE(fs::exists(path("out"))) << arguments[1];
  }
  const ProgramResult posed = run_trigmesh({"reconstruct",
                                            path("photos"),
                                            "--output",
                                            path("out"),
                                            "--poses",
                                            (demo() / "gt").string(),
                                            "--marker-side",
                                            "0.1"},
                                           kTimeLimit);
  EXPECT_EQ(posed.exit_code, 2);
  EXPECT_THAT(posed.err, HasSubstr("given poses keep their unit"));
}

}  // namespace
}  // namespace trigmesh::test_support
