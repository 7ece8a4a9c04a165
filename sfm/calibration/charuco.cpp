#include "sfm/calibration/charuco.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "sfm/calibration/aruco.hpp"

namespace trigmesh {
namespace {

constexpr int kMinMarkers = 2;
constexpr int kMinCorners = 6;
/// Largest distance, in squares, between a marker's corners and where the rest of the board wants
/// them.
constexpr double kLayoutTolerance_squares = 0.35;
constexpr int kLargestWindow_px = 8;
constexpr int kSmallestWindow_px = 2;

/// Corners of marker `id` in the board's plane, in squares, corner 0 of the board at (0, 0).
std::optional<std::array<cv::Point2d, 4>> marker_corners(const Board& board,
                                                         CharucoLayout layout,
                                                         int id) {
  const auto square = charuco_marker_square(board, layout, id);
  if (!square) {
    return std::nullopt;
  }
  const double size = board.marker_m / board.square_m;
  const double left = square->x() - 1.0 + 0.5 * (1.0 - size);
  const double top = square->y() - 1.0 + 0.5 * (1.0 - size);
  return std::array<cv::Point2d, 4>{
      cv::Point2d{left, top}, {left + size, top}, {left + size, top + size}, {left, top + size}};
}

cv::Point2d pixel_of(const Eigen::Vector2d& p) {
  return {p.x(), p.y()};
}

cv::Point2d apply(const cv::Matx33d& h, const cv::Point2d& p) {
  const cv::Vec3d q = h * cv::Vec3d(p.x, p.y, 1.0);
  return {q[0] / q[2], q[1] / q[2]};
}

/// Pairs of places, on the board in squares and in the image in pixels.
struct Pairs {
  std::vector<cv::Point2d> on_board;
  std::vector<cv::Point2d> in_image;

  void add(const std::array<cv::Point2d, 4>& corners, const MarkerDetection& marker) {
    for (std::size_t i = 0; i < 4; ++i) {
      on_board.push_back(corners[i]);
      in_image.push_back(pixel_of(marker.corners_px[i]));
    }
  }
};

/// Markers that stand where the layout says, judged by one homography of the whole board (in
/// squares, so that a wide-angle lens, which bends the board by a fraction of a square, does not
/// matter).
std::vector<MarkerDetection> consistent_markers(const std::vector<MarkerDetection>& markers,
                                                const Board& board,
                                                CharucoLayout layout) {
  Pairs pairs;
  std::vector<MarkerDetection> candidates;
  for (const MarkerDetection& marker : markers) {
    if (const auto corners = marker_corners(board, layout, marker.id)) {
      pairs.add(*corners, marker);
      candidates.push_back(marker);
    }
  }
  if (candidates.size() < kMinMarkers) {
    return {};
  }
  const cv::Mat board_from_image =
      cv::findHomography(pairs.in_image, pairs.on_board, cv::RANSAC, kLayoutTolerance_squares);
  if (board_from_image.empty()) {
    return {};
  }
  const cv::Matx33d h = board_from_image;
  std::vector<MarkerDetection> kept;
  for (std::size_t m = 0; m < candidates.size(); ++m) {
    bool agrees = true;
    for (std::size_t i = 4 * m; i < 4 * m + 4; ++i) {
      agrees = agrees &&
               cv::norm(apply(h, pairs.in_image[i]) - pairs.on_board[i]) < kLayoutTolerance_squares;
    }
    if (agrees) {
      kept.push_back(candidates[m]);
    }
  }
  return kept;
}

/// Where corner (column, row) should be by the homography of the markers in the squares around it;
/// nothing when none of them was seen. `window_px`: half the side of a square around the corner
/// that no marker reaches.
struct Prediction {
  cv::Point2d pixel;
  double window_px = 0.0;
};

std::optional<Prediction> predict_corner(const std::map<int, MarkerDetection>& markers,
                                         const Board& board,
                                         CharucoLayout layout,
                                         int column,
                                         int row) {
  Pairs pairs;
  for (const auto& [id, marker] : markers) {
    const auto square = charuco_marker_square(board, layout, id);
    // Corner (c, r) is shared by the squares (c, r) .. (c + 1, r + 1).
    const int dx = square->x() - column;
    const int dy = square->y() - row;
    if (dx >= 0 && dx <= 1 && dy >= 0 && dy <= 1) {
      pairs.add(*marker_corners(board, layout, id), marker);
    }
  }
  if (pairs.on_board.empty()) {
    return std::nullopt;
  }
  const cv::Mat image_from_board = cv::findHomography(pairs.on_board, pairs.in_image);
  if (image_from_board.empty()) {
    return std::nullopt;
  }
  const cv::Matx33d h = image_from_board;
  const cv::Point2d place(column, row);
  Prediction prediction{.pixel = apply(h, place), .window_px = 1e9};
  for (const cv::Point2d& corner : pairs.in_image) {
    const cv::Point2d d = corner - prediction.pixel;
    prediction.window_px = std::min(prediction.window_px, std::max(std::abs(d.x), std::abs(d.y)));
  }
  return prediction;
}

/// Refines one predicted corner on the image; nothing when it lies at the border or the refinement
/// runs away.
std::optional<Eigen::Vector2d> refine_corner(const cv::Mat& grey, const Prediction& prediction) {
  const int window = std::clamp(
      static_cast<int>(0.7 * prediction.window_px), kSmallestWindow_px, kLargestWindow_px);
  const auto margin = static_cast<double>(window + 2);
  const cv::Point2d& p = prediction.pixel;
  if (!(p.x >= margin && p.y >= margin && p.x <= grey.cols - 1 - margin &&
        p.y <= grey.rows - 1 - margin)) {
    return std::nullopt;
  }
  std::vector<cv::Point2f> points{cv::Point2f(static_cast<float>(p.x), static_cast<float>(p.y))};
  cv::cornerSubPix(grey,
                   points,
                   {window, window},
                   {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-3});
  const Eigen::Vector2d refined(static_cast<double>(points[0].x), static_cast<double>(points[0].y));
  const double moved = (refined - Eigen::Vector2d(p.x, p.y)).norm();
  // cornerSubPix gives back its start when it diverges; a prediction is never right to a thousandth
  // of a pixel.
  if (moved > window || moved == 0.0) {
    return std::nullopt;
  }
  return refined;
}

std::vector<BoardCorner> find_corners(const cv::Mat& grey,
                                      const std::vector<MarkerDetection>& markers,
                                      const Board& board,
                                      CharucoLayout layout) {
  std::map<int, MarkerDetection> by_id;
  for (const MarkerDetection& marker : markers) {
    by_id.emplace(marker.id, marker);
  }
  std::vector<BoardCorner> corners;
  for (int row = 0; row < board.corner_rows(); ++row) {
    for (int column = 0; column < board.corner_columns(); ++column) {
      const auto prediction = predict_corner(by_id, board, layout, column, row);
      if (!prediction) {
        continue;
      }
      if (const auto pixel = refine_corner(grey, *prediction)) {
        corners.push_back({.index = row * board.corner_columns() + column, .pixel = *pixel});
      }
    }
  }
  return corners;
}

/// Corners that all lie in one row or column of the board say nothing about its plane.
bool spans_plane(const std::vector<BoardCorner>& corners, const Board& board) {
  const auto differs = [&](auto coordinate) {
    return std::any_of(corners.begin(), corners.end(), [&](const BoardCorner& c) {
      return coordinate(c.index) != coordinate(corners.front().index);
    });
  };
  return !corners.empty() && differs([&](int i) { return i / board.corner_columns(); }) &&
         differs([&](int i) { return i % board.corner_columns(); });
}

}  // namespace

std::optional<Eigen::Vector2i> charuco_marker_square(const Board& board,
                                                     CharucoLayout layout,
                                                     int id) {
  const int first = layout == CharucoLayout::kBlackTopLeft ? 1 : 0;
  int remaining = id;
  for (int row = 0; row < board.rows && remaining >= 0; ++row) {
    const int start = (row + first) % 2;
    const int in_row = (board.columns - start + 1) / 2;
    if (remaining < in_row) {
      return Eigen::Vector2i(start + 2 * remaining, row);
    }
    remaining -= in_row;
  }
  return std::nullopt;
}

Result<BoardDetection> detect_charuco(const cv::Mat& grey, const Board& board) {
  TM_ASSIGN_OR_RETURN(const auto markers, detect_markers(grey, board.dictionary));
  BoardDetection detection;
  if (markers.empty()) {
    detection.problem =
        fmt::format("no marker of dictionary {} is seen", to_string(board.dictionary));
    return detection;
  }
  CharucoLayout layout = CharucoLayout::kBlackTopLeft;
  auto kept = consistent_markers(markers, board, layout);
  auto other = consistent_markers(markers, board, CharucoLayout::kWhiteTopLeft);
  if (other.size() > kept.size()) {
    layout = CharucoLayout::kWhiteTopLeft;
    kept = std::move(other);
  }
  if (kept.size() < kMinMarkers) {
    detection.problem = fmt::format(
        "{} markers are seen, but fewer than {} of them stand as on a board of {}x{} squares: "
        "check the size of the board and the dictionary",
        markers.size(),
        kMinMarkers,
        board.columns,
        board.rows);
    return detection;
  }
  detection.corners = find_corners(grey, kept, board, layout);
  if (detection.corners.size() < kMinCorners || !spans_plane(detection.corners, board)) {
    detection.problem = fmt::format(
        "only {} corners between {} markers are seen, at least {} in two directions are needed",
        detection.corners.size(),
        kept.size(),
        kMinCorners);
    detection.corners.clear();
  }
  return detection;
}

}  // namespace trigmesh
