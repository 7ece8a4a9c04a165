#pragma once

#include <optional>

#include "sfm/calibration/board.hpp"

namespace trigmesh {

/// Which squares of a ChArUco board carry markers.
enum class CharucoLayout {
  kBlackTopLeft,  ///< the first square is black: OpenCV since 4.6, calib.io
  kWhiteTopLeft,  ///< the first square holds marker 0: older OpenCV when the number of rows is even
};

/// Square (column, row) that holds marker `id`, or nothing when the board has no such marker.
[[nodiscard]] std::optional<Eigen::Vector2i> charuco_marker_square(const Board& board,
                                                                   CharucoLayout layout,
                                                                   int id);

/// detect_board for BoardKind::kCharuco: corners between squares, predicted from the neighbouring
/// markers by local homographies and refined on the image. `grey`: CV_8UC1; the board is valid. May
/// throw cv::Exception.
[[nodiscard]] Result<BoardDetection> detect_charuco(const cv::Mat& grey, const Board& board);

}  // namespace trigmesh
