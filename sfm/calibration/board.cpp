#include "sfm/calibration/board.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "sfm/calibration/charuco.hpp"

namespace trigmesh {
namespace {

constexpr int kMinSide = 3;
constexpr int kMaxSide = 100;
constexpr double kLargestSquare_m = 10.0;
constexpr double kWindow_ratio = 0.4;  ///< of the smallest distance between corners
constexpr int kSmallestWindow_px = 2;
constexpr int kLargestWindow_px = 11;

Result<> validate_markers(const Board& board) {
  if (!(board.marker_m > 0.0 && board.marker_m < board.square_m)) {
    return fail(ErrorCode::kInvalidArgument,
                "marker size is {} m, must be larger than 0 and smaller than the square ({} m)",
                board.marker_m,
                board.square_m);
  }
  const int needed = (board.columns * board.rows + 1) / 2;
  if (needed > board.dictionary.count) {
    return fail(ErrorCode::kInvalidArgument,
                "a board of {}x{} squares has {} markers, dictionary {} only {}",
                board.columns,
                board.rows,
                needed,
                to_string(board.dictionary),
                board.dictionary.count);
  }
  return {};
}

/// Half the side of the refinement window: as large as fits between a corner and its neighbours,
/// for precision, but not so large that the bending of the lines by the lens matters.
int refinement_window(const std::vector<cv::Point2f>& points, const cv::Size& size) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const auto at = [&](int r, int c) {
        return points[static_cast<std::size_t>(r * size.width + c)];
      };
      if (column + 1 < size.width) {
        nearest = std::min(nearest, cv::norm(at(row, column) - at(row, column + 1)));
      }
      if (row + 1 < size.height) {
        nearest = std::min(nearest, cv::norm(at(row, column) - at(row + 1, column)));
      }
    }
  }
  return std::clamp(
      static_cast<int>(kWindow_ratio * nearest), kSmallestWindow_px, kLargestWindow_px);
}

void refine_corners(const cv::Mat& grey, const cv::Size& size, std::vector<cv::Point2f>& points) {
  const int window = refinement_window(points, size);
  cv::cornerSubPix(grey,
                   points,
                   {window, window},
                   {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-3});
}

/// The sector-based detector (A. Duda, U. Frese, BMVC 2018): finds boards under strong distortion
/// and gives corners to a few hundredths of a pixel.
BoardDetection detect_chessboard(const cv::Mat& grey, const Board& board) {
  std::vector<cv::Point2f> points;
  const bool found =
      cv::findChessboardCornersSB(grey,
                                  {board.columns, board.rows},
                                  points,
                                  cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY);
  BoardDetection detection;
  if (found) {
    refine_corners(grey, {board.columns, board.rows}, points);
  }
  if (!found || std::ssize(points) != board.corner_count()) {
    detection.problem = fmt::format(
        "no chessboard of {}x{} inner corners is seen whole", board.columns, board.rows);
    return detection;
  }
  for (int i = 0; i < board.corner_count(); ++i) {
    const cv::Point2f& p = points[static_cast<std::size_t>(i)];
    detection.corners.push_back(
        {.index = i, .pixel = {static_cast<double>(p.x), static_cast<double>(p.y)}});
  }
  return detection;
}

}  // namespace

std::string_view to_string(BoardKind kind) {
  return kind == BoardKind::kCharuco ? "charuco" : "chessboard";
}

Result<> Board::validate() const {
  if (columns < kMinSide || rows < kMinSide || columns > kMaxSide || rows > kMaxSide) {
    return fail(ErrorCode::kInvalidArgument,
                "board is {}x{}, both numbers must be in [{}, {}]",
                columns,
                rows,
                kMinSide,
                kMaxSide);
  }
  if (!(square_m > 0.0 && square_m <= kLargestSquare_m)) {
    return fail(ErrorCode::kInvalidArgument,
                "square size is {} m, must be in (0, {}]",
                square_m,
                kLargestSquare_m);
  }
  return kind == BoardKind::kCharuco ? validate_markers(*this) : Result<>{};
}

Eigen::Vector2d Board::corner_m(int index) const {
  return square_m * Eigen::Vector2d(index % corner_columns(), index / corner_columns());
}

Result<BoardDetection> detect_board(const cv::Mat& grey, const Board& board) {
  TM_RETURN_IF_ERROR(board.validate());
  if (grey.type() != CV_8UC1 || grey.cols < 16 || grey.rows < 16) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot look for a board: need an 8-bit grey image of at least 16x16, got {}x{} of "
                "OpenCV type {}",
                grey.cols,
                grey.rows,
                grey.type());
  }
  try {
    return board.kind == BoardKind::kCharuco ? detect_charuco(grey, board)
                                             : detect_chessboard(grey, board);
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::kInternal, "cannot look for a board: {}", error.what());
  }
}

}  // namespace trigmesh
