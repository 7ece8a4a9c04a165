#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/calibration/marker_dictionary.hpp"

namespace trigmesh {

enum class BoardKind {
  kChessboard,  ///< plain chessboard; seen whole or not at all
  kCharuco,     ///< chessboard with ArUco markers in its white squares; may be seen in part
};

/// "chessboard", "charuco".
[[nodiscard]] std::string_view to_string(BoardKind kind);

/// A printed calibration board. Its plane is z = 0, x along the rows of squares, y down the
/// columns.
struct Board {
  BoardKind kind = BoardKind::kChessboard;
  /// Chessboard: inner corners along a row and along a column, as in OpenCV's samples, >= 3 each.
  /// ChArUco: squares, >= 3 each.
  int columns = 9;
  int rows = 6;
  double square_m = 0.025;  ///< side of a square, metres, (0, 10]
  /// ChArUco only: side of the black square of a marker, metres, (0, square_m), and its dictionary.
  /// Markers are numbered row by row from 0 and stand in the white squares; whether the square at
  /// the top left is black (OpenCV since 4.6) or white (older, for an even number of rows) is found
  /// out by looking.
  double marker_m = 0.0;
  MarkerDictionary dictionary;

  /// Names the field, its value and the violated rule; also when the dictionary has too few markers
  /// for the board.
  [[nodiscard]] Result<> validate() const;

  /// Inner corners along a row / along a column / together.
  [[nodiscard]] int corner_columns() const {
    return kind == BoardKind::kCharuco ? columns - 1 : columns;
  }

  [[nodiscard]] int corner_rows() const { return kind == BoardKind::kCharuco ? rows - 1 : rows; }

  [[nodiscard]] int corner_count() const { return corner_columns() * corner_rows(); }

  /// Place of inner corner `index` (row by row) in the board's plane, metres; corner 0 is the
  /// origin.
  [[nodiscard]] Eigen::Vector2d corner_m(int index) const;
};

/// An inner corner of the board in an image.
struct BoardCorner {
  int index = 0;          ///< row by row, [0, Board::corner_count())
  Eigen::Vector2d pixel;  ///< first pixel centre = (0, 0)
};

/// What was seen of the board in one image: corners by index, or the reason why there are none, as
/// half a sentence.
struct BoardDetection {
  std::vector<BoardCorner> corners;
  std::string problem;

  [[nodiscard]] bool found() const { return !corners.empty(); }
};

/// Looks for the board. Not finding it is an outcome, not an error. `grey`: CV_8UC1, at least
/// 16x16. kInvalidArgument: board or image; kInternal: OpenCV refused. Deterministic.
[[nodiscard]] Result<BoardDetection> detect_board(const cv::Mat& grey, const Board& board);

}  // namespace trigmesh
