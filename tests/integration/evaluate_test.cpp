#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sfm/exchange/model_folder.hpp"
#include "tests/integration/run_program.hpp"

namespace trigmesh::test_support {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Nine cameras on a spiral, given by formulas so that the committed figures stay true. `error`
/// moves and turns each.
Scene spiral(double error) {
  Scene scene;
  scene.cameras.push_back({CameraModel::kPinhole, 640, 480, 500, 500, 319.5, 239.5, {}});
  for (int i = 0; i < 9; ++i) {
    const double a = 0.3 * i;
    const Eigen::Vector3d center(4.0 * std::cos(a) + error * std::sin(5.0 * i),
                                 4.0 * std::sin(a) + error * std::cos(7.0 * i),
                                 0.1 * i * i + error * std::sin(3.0 * i));
    const Eigen::Quaterniond rotation =
        Eigen::AngleAxisd(error * std::cos(2.0 * i), Eigen::Vector3d::UnitX()) *
        Eigen::AngleAxisd(-a, Eigen::Vector3d::UnitZ());
    View view;
    view.name = "img" + std::to_string(i) + ".jpg";
    view.cam_from_world = Rigid3{rotation, -(rotation * center)};
    scene.views.push_back(view);
  }
  return scene;
}

/// The first eight of them, wrong by hundredths, and twice as large.
Scene estimate() {
  Scene scene = spiral(0.02);
  scene.views.pop_back();
  for (View& view : scene.views) {
    view.cam_from_world->translation *= 2.0;
  }
  return scene;
}

class Evaluate : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    ASSERT_TRUE(write_text_model(spiral(0.0), path("truth")).has_value());
    ASSERT_TRUE(write_text_model(estimate(), path("out/model/sparse")).has_value());
  }

  [[nodiscard]] ProgramResult evaluate(const std::vector<std::string>& options) const {
    std::vector<std::string> arguments{
        "evaluate", path("out"), "--truth", path("truth/images.txt")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_trigmesh(arguments);
  }

  /// registered, truth, rmse, median, max, rotation median, auc 1, 3, 5.
  [[nodiscard]] std::vector<double> figures(const std::vector<std::string>& options) const {
    std::vector<std::string> with_json = options;
    with_json.emplace_back("--json");
    const ProgramResult result = evaluate(with_json);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<double> values;
    const auto json = nlohmann::ordered_json::parse(result.out, nullptr, false);
    for (const auto& [key, value] : json.items()) {
      values.push_back(value.get<double>());
    }
    return values;
  }
};

void expect_near(const std::vector<double>& actual, const std::vector<double>& expected) {
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(actual[i], expected[i], 1e-6) << "figure " << i;
  }
}

// From an independent implementation in numpy (double precision) on the same two files.
const std::vector<double> kFigures{8,
                                   9,
                                   0.021137175958,
                                   0.020256082834,
                                   0.031253241688,
                                   0.825022057731,
                                   0.096366822642,
                                   0.480381506105,
                                   0.599340014774};
const std::vector<double> kMetricFigures{8,
                                         9,
                                         3.004198473538,
                                         2.701605767353,
                                         4.850090430340,
                                         0.825022057731,
                                         0.096366822642,
                                         0.480381506105,
                                         0.599340014774};

TEST_F(Evaluate, GivesTheFiguresOfAnIndependentImplementation) {
  expect_near(figures({}), kFigures);
  expect_near(figures({"--metric"}), kMetricFigures);
}

TEST_F(Evaluate, AgreesWithTheIndependentScriptOnTheSameFiles) {
  const char* data = std::getenv("TRIGMESH_DATA");
  const std::filesystem::path script =
      (data != nullptr ? std::filesystem::path(data) : source_path("../shared/data")) /
      std::filesystem::path("../tools/evaluate_poses.py");
  if (!std::filesystem::exists(script)) {
    GTEST_SKIP() << "neither TRIGMESH_DATA nor ../shared/data leads to ../tools/evaluate_poses.py";
  }
  // Runs it with 12 decimals instead of the 4 or 5 that it prints.
  const std::string wide =
      "import re, sys; p = sys.argv.pop(1); "
      "exec(compile(re.sub(r':\\.\\df\\}', ':.12f}', open(p).read()), p, 'exec'))";
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{}, std::vector<std::string>{"--metric"}}) {
    std::vector<std::string> command{"/usr/bin/python3",
                                     "-c",
                                     wide,
                                     script.string(),
                                     path("truth/images.txt"),
                                     path("out/model/sparse/images.txt")};
    command.insert(command.end(), options.begin(), options.end());
    const ProgramResult result = run_program(command);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    std::vector<double> expected(9);
    ASSERT_EQ(std::sscanf(result.out.c_str(),
                          "registered %lf/%lf rmse %lf median %lf max %lf rot_med %lf deg "
                          "auc@1 %lf auc@3 %lf auc@5 %lf",
                          &expected[0],
                          &expected[1],
                          &expected[2],
                          &expected[3],
                          &expected[4],
                          &expected[5],
                          &expected[6],
                          &expected[7],
                          &expected[8]),
              9)
        << result.out;
    expect_near(figures(options), expected);
  }
}

TEST_F(Evaluate, PrintsOneLine) {
  const ProgramResult result = evaluate({});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, StartsWith("registered 8/9  rmse 0.0"));
  EXPECT_EQ(result.out.find('\n'), result.out.size() - 1);
}

TEST_F(Evaluate, EndsWithFourWhenAThresholdIsMissed) {
  EXPECT_EQ(
      evaluate({"--max-rmse", "0.1", "--min-registered", "8", "--min-auc1", "0.01"}).exit_code, 0);
  for (const std::vector<std::string>& options : {std::vector<std::string>{"--max-rmse", "0.001"},
                                                  {"--min-registered", "9"},
                                                  {"--min-auc1", "0.99"}}) {
    const ProgramResult result = evaluate(options);
    EXPECT_EQ(result.exit_code, 4);
    EXPECT_THAT(result.out, StartsWith("registered"));
    EXPECT_THAT(result.err, HasSubstr("required"));
  }
}

TEST_F(Evaluate, TakesAModelAsTruth) {
  const ProgramResult result =
      run_trigmesh({"evaluate", path("out"), "--truth", path("out/model")});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, StartsWith("registered 8/8  rmse 0.00000"));
}

TEST_F(Evaluate, NeedsThreeCommonImages) {
  Scene scene = estimate();
  scene.views.resize(2);
  ASSERT_TRUE(write_text_model(scene, path("out/model/sparse")).has_value());
  const ProgramResult result = evaluate({});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("only 2 of the 9 images"));
}

TEST_F(Evaluate, SaysWhenThereIsNoTruth) {
  const ProgramResult result =
      run_trigmesh({"evaluate", path("out"), "--truth", path("missing.txt")});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("missing.txt: No such file or directory"));
}

}  // namespace
}  // namespace trigmesh::test_support
