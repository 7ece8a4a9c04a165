#include "sfm/keyframes/image_pyramid.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr int kSmallestSide = 16;

void reduce(const cv::Mat& grey, int side_px, cv::Mat& reduced) {
  const int side = std::max(grey.cols, grey.rows);
  if (side <= side_px) {
    grey.copyTo(reduced);
    return;
  }
  const double scale = static_cast<double>(side_px) / side;
  cv::resize(grey, reduced, {}, scale, scale, cv::INTER_AREA);
}

}  // namespace

void build_halves(int levels, ImagePyramid& pyramid) {
  TM_CHECK(!pyramid.empty() && pyramid.front().type() == CV_8UC1);
  std::size_t level = 1;
  for (; level < static_cast<std::size_t>(levels); ++level) {
    const cv::Mat whole = pyramid[level - 1];
    if (std::min(whole.cols, whole.rows) < 2 * kSmallestSide) {
      break;
    }
    pyramid.resize(std::max(pyramid.size(), level + 1));
    // The mean of 2 x 2 pixels: a pixel's centre is that of the four below it.
    cv::resize(whole(cv::Rect(0, 0, whole.cols / 2 * 2, whole.rows / 2 * 2)),
               pyramid[level],
               {whole.cols / 2, whole.rows / 2},
               0,
               0,
               cv::INTER_AREA);
  }
  pyramid.resize(level);
}

std::shared_ptr<const ImagePyramid> PyramidPool::make(const cv::Mat& grey,
                                                      int side_px,
                                                      int levels) {
  const std::shared_ptr<ImagePyramid>& pyramid = free_one();
  reduce(grey, side_px, pyramid->front());
  build_halves(levels, *pyramid);
  return pyramid;
}

const std::shared_ptr<ImagePyramid>& PyramidPool::free_one() {
  const auto is_free = [](const std::shared_ptr<ImagePyramid>& one) {
    return one.use_count() == 1;
  };
  const auto found = std::find_if(pyramids_.begin(), pyramids_.end(), is_free);
  return found != pyramids_.end() ? *found
                                  : pyramids_.emplace_back(std::make_shared<ImagePyramid>(1));
}

}  // namespace trigmesh
