#include "sfm/dense/reference_patch.hpp"

#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

struct Place {
  int x;
  int y;
};

/// A 5x5 grid of step 2 and the four diagonal neighbours; the last three are unused.
constexpr std::size_t kUsedPlaces = 29;
constexpr std::array<Place, kPatchSampleCount> kPlaces{{
    {-2, -2}, {-1, -2}, {0, -2}, {1, -2}, {2, -2}, {-2, -1}, {-1, -1}, {0, -1},
    {1, -1},  {2, -1},  {-2, 0}, {-1, 0}, {0, 0},  {1, 0},   {2, 0},   {-2, 1},
    {-1, 1},  {0, 1},   {1, 1},  {2, 1},  {-2, 2}, {-1, 2},  {0, 2},   {1, 2},
    {2, 2},   {4, 0},   {-4, 0}, {0, 4},  {0, -4}, {0, 0},   {0, 0},   {0, 0},
}};
constexpr float kPlaceSigma_px = 3.0F;
/// Patches with less variance than this, grey levels squared, are enlarged.
constexpr float kPlainVariance = 9.0F;
constexpr int kLargestMagnification = 3;

}  // namespace

ReferencePatchMaker::ReferencePatchMaker(const cv::Mat& grey, float grey_sigma) : grey_(grey) {
  TM_CHECK(grey.type() == CV_8UC1 && grey_sigma > 0.0F);
  for (std::size_t i = 0; i < weight_of_difference_.size(); ++i) {
    weight_of_difference_[i] = std::exp(-static_cast<float>(i) / grey_sigma);
  }
  for (std::size_t i = 0; i < kUsedPlaces; ++i) {
    const auto square =
        static_cast<float>(kPlaces[i].x * kPlaces[i].x + kPlaces[i].y * kPlaces[i].y);
    weight_of_place_[i] = std::exp(-square / (2.0F * kPlaceSigma_px * kPlaceSigma_px));
  }
}

int ReferencePatchMaker::make(int x, int y, ReferencePatch& patch) const {
  int magnification = 1;
  cut(x, y, magnification, patch);
  while (patch.variance < kPlainVariance && magnification < kLargestMagnification) {
    cut(x, y, ++magnification, patch);
  }
  return magnification;
}

void ReferencePatchMaker::cut(int x, int y, int magnification, ReferencePatch& patch) const {
  const int center = grey_.at<std::uint8_t>(y, x);
  std::array<float, kPatchSampleCount> grey{};
  float total = 0.0F;
  float mean = 0.0F;
  for (std::size_t i = 0; i < kPatchSampleCount; ++i) {
    const Place place{magnification * kPlaces[i].x, magnification * kPlaces[i].y};
    patch.offset_x_px[i] = static_cast<float>(place.x);
    patch.offset_y_px[i] = static_cast<float>(place.y);
    const int column = x + place.x;
    const int row = y + place.y;
    if (column < 0 || row < 0 || column >= grey_.cols || row >= grey_.rows) {
      patch.weight[i] = 0.0F;
      continue;
    }
    const int value = grey_.ptr<std::uint8_t>(row)[column];
    grey[i] = static_cast<float>(value);
    patch.weight[i] = weight_of_place_[i] *
                      weight_of_difference_[static_cast<std::size_t>(std::abs(value - center))];
    total += patch.weight[i];
    mean += patch.weight[i] * grey[i];
  }
  mean /= total;
  patch.variance = 0.0F;
  for (std::size_t i = 0; i < kPatchSampleCount; ++i) {
    patch.weight[i] /= total;
    const float deviation = grey[i] - mean;
    patch.weighted_deviation[i] = patch.weight[i] * deviation;
    patch.variance += patch.weighted_deviation[i] * deviation;
  }
}

}  // namespace trigmesh
