#include "sfm/calibration/board.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/calibration/charuco.hpp"
#include "tests/support/board_renderer.hpp"

namespace trigmesh {
namespace {

using test_support::board_pattern;
using test_support::board_pose;
using test_support::PlaneRenderer;
using ::testing::HasSubstr;

Camera wide_camera() {
  return {.model = CameraModel::kBrownConrady,
          .width_px = 480,
          .height_px = 360,
          .fx_px = 400.0,
          .fy_px = 402.0,
          .cx_px = 243.0,
          .cy_px = 176.0,
          .distortion = {-0.25, 0.08, 0.001, -0.0005}};
}

Board chessboard() {
  return {
      .kind = BoardKind::kChessboard, .columns = 7, .rows = 5, .square_m = 0.03, .dictionary = {}};
}

Board charuco() {
  return {.kind = BoardKind::kCharuco,
          .columns = 7,
          .rows = 6,
          .square_m = 0.03,
          .marker_m = 0.022,
          .dictionary = {.bits = 4, .count = 50}};
}

Rigid3 tilted_pose(const Board& board) {
  return board_pose(board.corner_m(board.corner_count() - 1), 0.33, {0.02, 0.03}, {20, -25, 8});
}

struct CornerErrors {
  double mean_px = 0.0;
  double largest_px = 0.0;
};

/// A chessboard with two odd numbers of corners looks the same upside down: `last_index` counts
/// from the other end.
CornerErrors errors_of(const BoardDetection& detection,
                       const Board& board,
                       const Rigid3& pose,
                       int last_index = -1) {
  CornerErrors errors;
  for (const BoardCorner& corner : detection.corners) {
    const Eigen::Vector2d place =
        board.corner_m(last_index < 0 ? corner.index : last_index - corner.index);
    const auto truth = project(wide_camera(), pose * Eigen::Vector3d(place.x(), place.y(), 0.0));
    const double error_px = (*truth - corner.pixel).norm();
    errors.largest_px = std::max(errors.largest_px, error_px);
    errors.mean_px += error_px / static_cast<double>(detection.corners.size());
  }
  return errors;
}

TEST(Board, ChessboardCornersAreFoundToAFractionOfAPixel) {
  const Board board = chessboard();
  const Rigid3 pose = tilted_pose(board);
  const auto detection =
      detect_board(PlaneRenderer(wide_camera()).render(board_pattern(board), pose, 2.0, 1), board);
  ASSERT_TRUE(detection.has_value());
  ASSERT_EQ(detection->corners.size(), 35U) << detection->problem;
  EXPECT_LT(std::min(errors_of(*detection, board, pose).largest_px,
                     errors_of(*detection, board, pose, 34).largest_px),
            0.3);
}

TEST(Board, CharucoCornersAreFoundInBothLayouts) {
  const Board board = charuco();
  const Rigid3 pose = tilted_pose(board);
  for (const CharucoLayout layout : {CharucoLayout::kBlackTopLeft, CharucoLayout::kWhiteTopLeft}) {
    const auto detection = detect_board(
        PlaneRenderer(wide_camera()).render(board_pattern(board, layout), pose, 2.0, 1), board);
    ASSERT_TRUE(detection.has_value());
    EXPECT_GE(detection->corners.size(), 28U) << detection->problem;
    EXPECT_LT(errors_of(*detection, board, pose).mean_px, 0.18);
    EXPECT_LT(errors_of(*detection, board, pose).largest_px, 0.4);
  }
}

TEST(Board, CharucoIsUsedWhereOnlyAPartIsSeen) {
  const Board board = charuco();
  const Rigid3 pose =
      board_pose(board.corner_m(board.corner_count() - 1), 0.3, {0.62, 0.1}, {10, -25, 8});
  const auto detection =
      detect_board(PlaneRenderer(wide_camera()).render(board_pattern(board), pose, 2.0, 1), board);
  ASSERT_TRUE(detection.has_value());
  EXPECT_GE(detection->corners.size(), 6U) << detection->problem;
  EXPECT_LT(detection->corners.size(), 30U);
  EXPECT_LT(errors_of(*detection, board, pose).largest_px, 0.4);
}

TEST(Board, ReasonIsGivenWhenTheBoardIsNotThere) {
  const cv::Mat flat(200, 300, CV_8UC1, cv::Scalar(140));
  const auto chess = detect_board(flat, chessboard());
  ASSERT_TRUE(chess.has_value());
  EXPECT_FALSE(chess->found());
  EXPECT_THAT(chess->problem, HasSubstr("no chessboard of 7x5"));
  const auto markers = detect_board(flat, charuco());
  ASSERT_TRUE(markers.has_value());
  EXPECT_FALSE(markers->found());
  EXPECT_THAT(markers->problem, HasSubstr("no marker of dictionary 4x4_50"));
}

TEST(Board, CharucoOfAnotherSizeIsRefused) {
  Board printed = charuco();
  const cv::Mat image =
      PlaneRenderer(wide_camera()).render(board_pattern(printed), tilted_pose(printed), 1.0, 1);
  Board expected = printed;
  expected.columns = 4;
  const auto detection = detect_board(image, expected);
  ASSERT_TRUE(detection.has_value());
  EXPECT_FALSE(detection->found());
  EXPECT_FALSE(detection->problem.empty());
}

TEST(Board, InvalidBoardsAreNamed) {
  const auto message_of = [](const Board& board) {
    const auto valid = board.validate();
    return valid ? std::string() : valid.error().message;
  };
  Board board = charuco();
  EXPECT_EQ(message_of(board), "");
  board.marker_m = 0.05;
  EXPECT_THAT(message_of(board), HasSubstr("marker size"));
  board = charuco();
  board.columns = 20;
  EXPECT_THAT(message_of(board), HasSubstr("60 markers"));
  board = chessboard();
  board.rows = 2;
  EXPECT_THAT(message_of(board), HasSubstr("7x2"));
  board = chessboard();
  board.square_m = 0.0;
  EXPECT_THAT(message_of(board), HasSubstr("square size"));
}

TEST(CharucoLayout, MarkersAreNumberedRowByRowInTheWhiteSquares) {
  const Board board{.kind = BoardKind::kCharuco,
                    .columns = 5,
                    .rows = 4,
                    .square_m = 0.04,
                    .marker_m = 0.03,
                    .dictionary = {}};
  // OpenCV 4.6 draws such a board with a black square at the top left and marker 0 to the right of
  // it.
  EXPECT_EQ(charuco_marker_square(board, CharucoLayout::kBlackTopLeft, 0), Eigen::Vector2i(1, 0));
  EXPECT_EQ(charuco_marker_square(board, CharucoLayout::kBlackTopLeft, 2), Eigen::Vector2i(0, 1));
  EXPECT_EQ(charuco_marker_square(board, CharucoLayout::kWhiteTopLeft, 0), Eigen::Vector2i(0, 0));
  EXPECT_EQ(charuco_marker_square(board, CharucoLayout::kWhiteTopLeft, 3), Eigen::Vector2i(1, 1));
  EXPECT_EQ(charuco_marker_square(board, CharucoLayout::kBlackTopLeft, 9), Eigen::Vector2i(4, 3));
  EXPECT_EQ(charuco_marker_square(board, CharucoLayout::kBlackTopLeft, 10), std::nullopt);
}

}  // namespace
}  // namespace trigmesh
