#include "sfm/calibration/calibration.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/calibration/planar_pose.hpp"
#include "tests/support/board_renderer.hpp"
#include "tests/support/random.hpp"

namespace trigmesh {
namespace {

using test_support::board_pattern;
using test_support::board_pose;
using test_support::PlaneRenderer;
using test_support::varied_board_poses;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

Camera true_camera(CameraModel model) {
  Camera camera{.model = model,
                .width_px = 640,
                .height_px = 480,
                .fx_px = 530.0,
                .fy_px = 533.0,
                .cx_px = 325.0,
                .cy_px = 236.0,
                .distortion = {}};
  switch (model) {
    case CameraModel::kPinhole:
      break;
    case CameraModel::kRadial:
      camera.distortion = {-0.28, 0.09, 0.0, 0.0};
      break;
    case CameraModel::kBrownConrady:
      camera.distortion = {-0.28, 0.09, 0.0012, -0.0007};
      break;
    case CameraModel::kKannalaBrandt:
      camera.fx_px = 290.0;
      camera.fy_px = 291.0;
      camera.distortion = {0.04, -0.01, 0.004, -0.001};
      break;
  }
  return camera;
}

Board board_9x6() {
  return {
      .kind = BoardKind::kChessboard, .columns = 9, .rows = 6, .square_m = 0.025, .dictionary = {}};
}

/// Corners by the formula, with noise. Points that fall outside the image are left out.
CalibrationView exact_view(const Camera& camera,
                           const Rigid3& pose,
                           double noise_px,
                           test_support::Random& random) {
  const Board board = board_9x6();
  CalibrationView view;
  for (int i = 0; i < board.corner_count(); ++i) {
    const Eigen::Vector2d place = board.corner_m(i);
    const auto pixel = project(camera, pose * Eigen::Vector3d(place.x(), place.y(), 0.0));
    if (pixel && pixel->x() > 0.0 && pixel->y() > 0.0 && pixel->x() < camera.width_px - 1.0 &&
        pixel->y() < camera.height_px - 1.0) {
      view.board_m.push_back(place);
      view.pixels.emplace_back(*pixel +
                               noise_px * Eigen::Vector2d{random.normal(), random.normal()});
    }
  }
  return view;
}

std::vector<CalibrationView> exact_views(const Camera& camera, int count, double noise_px) {
  test_support::Random random(4);
  std::vector<CalibrationView> views;
  for (const Rigid3& pose : varied_board_poses(camera, {0.2, 0.125}, count)) {
    views.push_back(exact_view(camera, pose, noise_px, random));
  }
  return views;
}

CalibrationOptions options_for(const Camera& camera) {
  return {.model = camera.model, .width_px = camera.width_px, .height_px = camera.height_px};
}

class EveryLensModel : public ::testing::TestWithParam<CameraModel> {};

TEST_P(EveryLensModel, ExactCornersGiveTheExactCamera) {
  const Camera truth = true_camera(GetParam());
  const auto report = calibrate_camera(exact_views(truth, 12, 0.0), options_for(truth));
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_EQ(report->views_used, 12U);
  EXPECT_LT(report->rms_px, 1e-5);
  EXPECT_LT((report->camera.intrinsics() - truth.intrinsics()).head<4>().cwiseAbs().maxCoeff(),
            1e-2);
  EXPECT_LT((report->camera.intrinsics() - truth.intrinsics()).tail<4>().cwiseAbs().maxCoeff(),
            1e-3);
}

TEST_P(EveryLensModel, NoisyCornersGiveTheCameraWithinItsStatedDeviation) {
  const Camera truth = true_camera(GetParam());
  const auto report = calibrate_camera(exact_views(truth, 14, 0.2), options_for(truth));
  ASSERT_TRUE(report.has_value()) << report.error().message;
  // 0.2 px in x and in y: a distance of 0.28 px, less what the parameters absorb.
  EXPECT_NEAR(report->rms_px, 0.2 * std::sqrt(2.0), 0.02);
  for (Eigen::Index i = 0; i < 4 + distortion_count(truth.model); ++i) {
    EXPECT_GT(report->standard_deviation[i], 0.0);
    EXPECT_LT(std::abs(report->camera.intrinsics()[i] - truth.intrinsics()[i]),
              4.0 * report->standard_deviation[i])
        << "parameter " << i;
  }
  EXPECT_LT(report->standard_deviation[0], 2.0);
}

INSTANTIATE_TEST_SUITE_P(Models,
                         EveryLensModel,
                         ::testing::Values(CameraModel::kPinhole,
                                           CameraModel::kRadial,
                                           CameraModel::kBrownConrady,
                                           CameraModel::kKannalaBrandt),
                         [](const auto& param_info) {
                           return std::string(to_string(param_info.param));
                         });

TEST(Calibration, WronglyDetectedViewIsPutAside) {
  const Camera truth = true_camera(CameraModel::kBrownConrady);
  auto views = exact_views(truth, 10, 0.1);
  for (std::size_t i = 0; i < views[3].pixels.size(); i += 2) {
    views[3].pixels[i] += Eigen::Vector2d(6.0, -5.0);
  }
  const auto report = calibrate_camera(views, options_for(truth));
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_EQ(report->views_used, 9U);
  EXPECT_FALSE(report->views[3].used);
  EXPECT_GT(report->views[3].rms_px, 2.0);
  EXPECT_NEAR(report->camera.fx_px, truth.fx_px, 2.0);
}

TEST(Calibration, SameViewsGiveTheSameBits) {
  const auto views = exact_views(true_camera(CameraModel::kRadial), 8, 0.3);
  const auto options = options_for(true_camera(CameraModel::kRadial));
  EXPECT_EQ(calibrate_camera(views, options)->camera, calibrate_camera(views, options)->camera);
}

TEST(Calibration, FewerThanThreeViewsAreRefused) {
  const Camera truth = true_camera(CameraModel::kPinhole);
  const auto report = calibrate_camera(exact_views(truth, 2, 0.0), options_for(truth));
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, ErrorCode::kInsufficientData);
  EXPECT_THAT(report.error().message, HasSubstr("2 views"));
}

TEST(Calibration, FewAndFrontalViewsAreWarnedAbout) {
  const Camera truth = true_camera(CameraModel::kPinhole);
  test_support::Random random(9);
  std::vector<CalibrationView> views;
  for (int i = 0; i < 4; ++i) {
    views.push_back(
        exact_view(truth,
                   board_pose({0.2, 0.125}, 0.5 + 0.05 * i, {0.0, 0.0}, {2.0 * i, -1.0, 5.0}),
                   0.1,
                   random));
  }
  const auto report = calibrate_camera(views, options_for(truth));
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_THAT(report->warnings, Contains(HasSubstr("only 4 views")));
  EXPECT_THAT(report->warnings, Contains(HasSubstr("faces the camera")));
  EXPECT_THAT(report->warnings, Contains(HasSubstr("of the image: take views")));
  EXPECT_THAT(report->warnings, Contains(HasSubstr("focal length poorly")));
}

TEST(Calibration, GoodViewsCarryNoWarning) {
  const Camera truth = true_camera(CameraModel::kBrownConrady);
  const auto report = calibrate_camera(exact_views(truth, 16, 0.1), options_for(truth));
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_THAT(report->warnings, ::testing::IsEmpty());
}

TEST(Calibration, PinholeOnADistortingLensIsWarnedAbout) {
  const Camera truth = true_camera(CameraModel::kRadial);
  CalibrationOptions options = options_for(truth);
  options.model = CameraModel::kPinhole;
  const auto report = calibrate_camera(exact_views(truth, 12, 0.1), options);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_THAT(report->warnings, Contains(HasSubstr("does the lens model fit")));
}

TEST(Calibration, DegenerateViewsAreRefusedNotCrashed) {
  const CalibrationOptions options = options_for(true_camera(CameraModel::kPinhole));
  CalibrationView line;
  for (int i = 0; i < 9; ++i) {
    line.board_m.emplace_back(0.025 * i, 0.0);
    line.pixels.emplace_back(100.0 + 20.0 * i, 200.0 + 3.0 * i);
  }
  const auto on_a_line = calibrate_camera(std::vector<CalibrationView>(5, line), options);
  ASSERT_FALSE(on_a_line.has_value());
  EXPECT_EQ(on_a_line.error().code, ErrorCode::kInsufficientData);
  line.pixels.pop_back();
  const auto uneven = calibrate_camera(std::vector<CalibrationView>(5, line), options);
  ASSERT_FALSE(uneven.has_value());
  EXPECT_EQ(uneven.error().code, ErrorCode::kInvalidArgument);
}

TEST(Calibration, OptionsOutOfRangeAreNamed) {
  const auto message_of = [](const CalibrationOptions& options) {
    return options.validate().error().message;
  };
  EXPECT_THAT(message_of({.width_px = 0, .height_px = 480}), HasSubstr("image size"));
  EXPECT_THAT(message_of({.width_px = 640, .height_px = 480, .outlier_ratio = 1.0}),
              HasSubstr("outlier_ratio"));
  EXPECT_THAT(message_of({.width_px = 640, .height_px = 480, .outlier_floor_px = 0.0}),
              HasSubstr("outlier_floor_px"));
}

TEST(PlanarPose, ExactPointsGiveTheExactPose) {
  const Camera camera = true_camera(CameraModel::kBrownConrady);
  const Rigid3 pose = board_pose({0.2, 0.125}, 0.5, {0.03, -0.02}, {25, -20, 40});
  test_support::Random random(1);
  const CalibrationView view = exact_view(camera, pose, 0.0, random);
  const auto found = planar_pose(camera, view);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(rotation_angle(found->rotation * pose.rotation.conjugate()), 1e-6);
  EXPECT_LT((found->translation - pose.translation).norm(), 1e-6);
  EXPECT_LT(view_rms_px(camera, *found, view), 1e-4);
}

TEST(PlanarPose, PointsOnALineHaveNone) {
  const Camera camera = true_camera(CameraModel::kPinhole);
  CalibrationView view;
  for (int i = 0; i < 6; ++i) {
    view.board_m.emplace_back(0.025 * i, 0.0);
    view.pixels.emplace_back(100.0 + 20.0 * i, 200.0);
  }
  EXPECT_EQ(planar_pose(camera, view).has_value(), false);
}

/// Boards rendered with blur-free pixels and noise, detected and calibrated: the whole way.
CalibrationReport calibrate_rendered(const Camera& truth, const Board& board, int count) {
  const PlaneRenderer renderer(truth);
  std::vector<CalibrationView> views;
  std::uint64_t seed = 1;
  for (const Rigid3& pose :
       varied_board_poses(truth, board.corner_m(board.corner_count() - 1), count)) {
    const auto detection =
        detect_board(renderer.render(board_pattern(board), pose, 2.0, seed++), board);
    EXPECT_TRUE(detection.has_value());
    CalibrationView view;
    for (const BoardCorner& corner : detection->corners) {
      view.board_m.push_back(board.corner_m(corner.index));
      view.pixels.push_back(corner.pixel);
    }
    if (detection->found()) {
      views.push_back(view);
    }
  }
  EXPECT_GE(views.size(), static_cast<std::size_t>(count) - 2);
  const auto report = calibrate_camera(views, options_for(truth));
  EXPECT_TRUE(report.has_value());
  return report ? *report : CalibrationReport{};
}

TEST(CalibrationOnRenderedBoards, ChessboardGivesTheCameraWithinAPixel) {
  const Camera truth = true_camera(CameraModel::kBrownConrady);
  const CalibrationReport report = calibrate_rendered(truth, board_9x6(), 8);
  EXPECT_LT(report.rms_px, 0.15);
  EXPECT_NEAR(report.camera.fx_px, truth.fx_px, 1.0);
  EXPECT_NEAR(report.camera.fy_px, truth.fy_px, 1.0);
  EXPECT_NEAR(report.camera.cx_px, truth.cx_px, 1.0);
  EXPECT_NEAR(report.camera.cy_px, truth.cy_px, 1.0);
  EXPECT_NEAR(report.camera.distortion[0], truth.distortion[0], 0.01);
}

TEST(CalibrationOnRenderedBoards, CharucoGivesAFisheyeWithinAPixel) {
  const Camera truth = true_camera(CameraModel::kKannalaBrandt);
  const Board board{.kind = BoardKind::kCharuco,
                    .columns = 9,
                    .rows = 7,
                    .square_m = 0.03,
                    .marker_m = 0.022,
                    .dictionary = {.bits = 4, .count = 50}};
  const CalibrationReport report = calibrate_rendered(truth, board, 8);
  EXPECT_LT(report.rms_px, 0.2);
  EXPECT_NEAR(report.camera.fx_px, truth.fx_px, 1.0);
  EXPECT_NEAR(report.camera.fy_px, truth.fy_px, 1.0);
  EXPECT_NEAR(report.camera.cx_px, truth.cx_px, 1.0);
  EXPECT_NEAR(report.camera.cy_px, truth.cy_px, 1.0);
}

}  // namespace
}  // namespace trigmesh
