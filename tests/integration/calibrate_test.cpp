// Runs the program on photographs of boards: rendered ones with a known camera, and real ones when
// they are there.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/camera_profile.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "tests/integration/run_program.hpp"
#include "tests/support/board_renderer.hpp"

namespace trigmesh {
namespace {

using test_support::board_pattern;
using test_support::PlaneRenderer;
using test_support::varied_board_poses;
using ::testing::HasSubstr;

constexpr std::chrono::seconds kTimeLimit(240);

struct Outcome {
  int exit_code = -1;
  std::string output;  ///< stdout, then stderr
};

Outcome calibrate(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "calibrate");
  const auto result = test_support::run_trigmesh(std::move(arguments), kTimeLimit);
  return {.exit_code = result.exit_code, .output = result.out + result.err};
}

class Calibrate : public test_support::ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    std::filesystem::create_directories(photos());
  }

  void write_photo(const std::string& name, const cv::Mat& grey) const {
    const auto bytes = encode_png(grey);
    ASSERT_TRUE(bytes.has_value());
    std::ofstream file(folder_ / "photos" / name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes->data()),
               static_cast<std::streamsize>(bytes->size()));
  }

  void write_photos(const Camera& camera, const Board& board, int count) const {
    const PlaneRenderer renderer(camera);
    const auto poses = varied_board_poses(camera, board.corner_m(board.corner_count() - 1), count);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      write_photo("view" + std::to_string(i) + ".png",
                  renderer.render(board_pattern(board), poses[i], 1.5, i + 1));
    }
  }

  [[nodiscard]] std::string photos() const { return path("photos"); }

  [[nodiscard]] std::string profile() const { return path("camera.toml"); }

  /// `trigmesh calibrate` on the photographs, with these options besides.
  [[nodiscard]] Outcome run(std::vector<std::string> options) const {
    options.insert(options.begin(), {photos(), "--output", profile()});
    return calibrate(std::move(options));
  }
};

Camera wide_camera() {
  return {.model = CameraModel::kBrownConrady,
          .width_px = 640,
          .height_px = 480,
          .fx_px = 530.0,
          .fy_px = 533.0,
          .cx_px = 325.0,
          .cy_px = 236.0,
          .distortion = {-0.28, 0.09, 0.0012, -0.0007}};
}

Board chessboard() {
  return {
      .kind = BoardKind::kChessboard, .columns = 9, .rows = 6, .square_m = 0.025, .dictionary = {}};
}

void expect_near(const Camera& found, const Camera& truth) {
  EXPECT_EQ(found.model, truth.model);
  EXPECT_EQ(found.width_px, truth.width_px);
  EXPECT_NEAR(found.fx_px, truth.fx_px, 1.5);
  EXPECT_NEAR(found.fy_px, truth.fy_px, 1.5);
  EXPECT_NEAR(found.cx_px, truth.cx_px, 1.5);
  EXPECT_NEAR(found.cy_px, truth.cy_px, 1.5);
}

TEST_F(Calibrate, ChessboardPhotographsGiveAProfile) {
  write_photos(wide_camera(), chessboard(), 8);
  write_photo("wall.png", cv::Mat(480, 640, CV_8UC1, cv::Scalar(100)));
  const Outcome outcome = run({"--board", "9x6", "--square", "25mm", "--name", "rig"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("wall.png: no chessboard of 9x6"));
  EXPECT_THAT(outcome.output, HasSubstr("rms 0."));
  const auto profiles = read_camera_file(profile());
  ASSERT_TRUE(profiles.has_value());
  EXPECT_EQ(profiles->front().name, "rig");
  EXPECT_LT(profiles->front().rms_px.value_or(9.0), 0.2);
  expect_near(profiles->front().camera, wide_camera());
}

TEST_F(Calibrate, CharucoPhotographsGiveAProfile) {
  const Board board{.kind = BoardKind::kCharuco,
                    .columns = 9,
                    .rows = 7,
                    .square_m = 0.03,
                    .marker_m = 0.022,
                    .dictionary = {.bits = 4, .count = 50}};
  write_photos(wide_camera(), board, 8);
  const Outcome outcome = run({"--target",
                               "charuco",
                               "--board",
                               "9x7",
                               "--square",
                               "3cm",
                               "--marker-size",
                               "22mm",
                               "--dictionary",
                               "DICT_4X4_50"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const auto profiles = read_camera_file(profile());
  ASSERT_TRUE(profiles.has_value());
  expect_near(profiles->front().camera, wide_camera());
}

TEST_F(Calibrate, PhotographsWithoutBoardAreNamedAndNothingIsWritten) {
  for (const char* name : {"a.png", "b.png", "c.png"}) {
    write_photo(name, cv::Mat(120, 160, CV_8UC1, cv::Scalar(100)));
  }
  const Outcome outcome = run({"--board", "9x6", "--square", "25mm"});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_THAT(outcome.output, HasSubstr("found in 0 of 3 photographs"));
  EXPECT_THAT(outcome.output, HasSubstr("b.png: no chessboard"));
  EXPECT_FALSE(std::filesystem::exists(profile()));
}

TEST_F(Calibrate, PhotographsOfDifferentSizesAreRefused) {
  write_photos(wide_camera(), chessboard(), 3);
  Camera small = wide_camera();
  small.width_px = 600;
  const auto pose = test_support::board_pose({0.2, 0.125}, 0.5, {0.0, 0.0}, {10, 10, 0});
  write_photo("small.png", PlaneRenderer(small).render(board_pattern(chessboard()), pose, 1.0, 1));
  const Outcome outcome = run({"--board", "9x6", "--square", "25mm"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.output, HasSubstr("600x480"));
}

TEST_F(Calibrate, WrongOptionsAreNamed) {
  EXPECT_THAT(run({"--board", "nine", "--square", "25mm"}).output, HasSubstr("--board is 'nine'"));
  EXPECT_THAT(run({"--board", "9x6", "--square", "25"}).output, HasSubstr("with its unit"));
  EXPECT_THAT(run({"--board", "9x6", "--square", "25mm", "--model", "plenoptic"}).output,
              HasSubstr("kannala-brandt"));
  EXPECT_THAT(run({"--board", "9x6", "--square", "25mm", "--target", "charuco"}).output,
              HasSubstr("--marker-size"));
  EXPECT_EQ(run({"--board", "9x6", "--square", "25"}).exit_code, 2);
}

TEST_F(Calibrate, HelpHasExamples) {
  const Outcome outcome = calibrate({"--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(
      outcome.output,
      HasSubstr("trigmesh calibrate photos --board 9x6 --square 25mm --output camera.toml"));
}

TEST_F(Calibrate, RealPhotographsComeCloseToOpenCvsResult) {
  const char* data = std::getenv("TRIGMESH_DATA");
  const auto root =
      data != nullptr ? std::filesystem::path(data) : test_support::source_path("../shared/data");
  const auto images = root / "calib_chessboard_left" / "images";
  if (!std::filesystem::exists(images)) {
    GTEST_SKIP() << "no calib_chessboard_left under " << root << "; set TRIGMESH_DATA";
  }
  const Outcome outcome =
      calibrate({images.string(), "--board", "9x6", "--square", "25mm", "--output", profile()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const auto profiles = read_camera_file(profile());
  ASSERT_TRUE(profiles.has_value());
  // OpenCV 4.6 calibrateCamera on the same photographs: 0.183 px.
  EXPECT_LT(profiles->front().rms_px.value_or(9.0), 0.185);
  EXPECT_NEAR(profiles->front().camera.fx_px, 533.13, 1.5);
  EXPECT_NEAR(profiles->front().camera.cx_px, 342.26, 1.5);
}

}  // namespace
}  // namespace trigmesh
