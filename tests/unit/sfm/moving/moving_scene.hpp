#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "sfm/moving/moving_view.hpp"

namespace trigmesh::test {

/// What stands in front of the wall.
enum class PlateKind {
  kNone,
  kTextured,       ///< a board with a picture on it, in another place in every view
  kPlainOnce,      ///< a plain board that shows in view 2 only
  kPlainStanding,  ///< a plain board that stands still in all views, without depth
};

struct MovingSceneOptions {
  PlateKind plate = PlateKind::kTextured;
  std::size_t views = 7;
  double exposure = 1.0;  ///< of view 2, factor on its colours
};

/// A textured wall at depth 4 seen by a row of cameras, 320x240 pixels, and a board at depth 3. The
/// depth maps hold the wall, as far as the board does not hide it.
struct MovingScene {
  std::vector<MovingView> views;
  std::vector<cv::Mat> truth;  ///< CV_8UC1, 255 = the board
};

[[nodiscard]] MovingScene make_moving_scene(const MovingSceneOptions& options);

/// Pixels of `mask` (may be empty) that are in the truth, over all of the truth.
[[nodiscard]] double recall(const cv::Mat& mask, const cv::Mat& truth);
/// The same, over all of the mask.
[[nodiscard]] double precision(const cv::Mat& mask, const cv::Mat& truth);

}  // namespace trigmesh::test
