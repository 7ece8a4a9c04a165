#include "sfm/calibration/edge_shift.hpp"

#include <cmath>
#include <functional>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "sfm/calibration/aruco.hpp"
#include "tests/support/board_renderer.hpp"

namespace trigmesh {
namespace {

using test_support::board_pose;
using test_support::marker_pattern;
using test_support::PlaneRenderer;

constexpr double kSideM = 0.1;
constexpr double kFocalPx = 400.0;

Camera small_camera() {
  return {.model = CameraModel::kPinhole,
          .width_px = 320,
          .height_px = 240,
          .fx_px = kFocalPx,
          .fy_px = kFocalPx,
          .cx_px = 159.5,
          .cy_px = 119.5};
}

using Change = std::function<cv::Mat(const cv::Mat&)>;

/// How far the sides of the found square lie outside of the true ones, mean over some poses,
/// pixels.
double outwards_px(const Change& change, double side_px) {
  const std::array<Eigen::Vector3d, 4> corners{Eigen::Vector3d(0.0, 0.0, 0.0),
                                               {kSideM, 0.0, 0.0},
                                               {kSideM, kSideM, 0.0},
                                               {0.0, kSideM, 0.0}};
  const PlaneRenderer renderer(small_camera());
  double sum = 0.0;
  int count = 0;
  for (int i = 0; i < 5; ++i) {
    const Rigid3 pose = board_pose({kSideM, kSideM},
                                   kFocalPx * kSideM / side_px,
                                   {0.003 * i, 0.002 * i},
                                   {10.0 * (i % 4) - 15.0, 8.0 * (i % 3) - 8.0, 7.0 * i + 3.0});
    const cv::Mat image = renderer.render(
        marker_pattern({}, i, kSideM), pose, 0.8, static_cast<std::uint64_t>(i + 1));
    const auto markers = detect_markers(change(image), MarkerDictionary{});
    if (!markers || markers->empty()) {
      ADD_FAILURE() << "marker " << i << " is not found";
      continue;
    }
    const auto& found = markers->front().corners_px;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d from = *project(small_camera(), pose * corners[k]);
      const Eigen::Vector2d to = *project(small_camera(), pose * corners[(k + 1) % 4]);
      const Eigen::Vector2d along = (to - from).normalized();
      const Eigen::Vector2d outward(along.y(), -along.x());
      sum += outward.dot(0.5 * (found[k] + found[(k + 1) % 4] - from - to));
      ++count;
    }
  }
  return sum / count;
}

cv::Mat through_light(const cv::Mat& image, const std::function<double(double)>& change) {
  cv::Mat table(1, 256, CV_8UC1);
  for (int i = 0; i < 256; ++i) {
    const double v = i / 255.0;
    const double light = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
    const double changed = std::min(1.0, change(light));
    const double srgb =
        changed <= 0.0031308 ? 12.92 * changed : 1.055 * std::pow(changed, 1.0 / 2.4) - 0.055;
    table.at<std::uint8_t>(0, i) = cv::saturate_cast<std::uint8_t>(255.0 * srgb);
  }
  cv::Mat result;
  cv::LUT(image, table, result);
  return result;
}

struct Imaging {
  const char* name;
  Change change;
};

class EdgesOfMarkers : public ::testing::TestWithParam<Imaging> {};

TEST_P(EdgesOfMarkers, AreSeenWhereTheyAre) {
  for (const double side_px : {45.0, 30.0}) {
    EXPECT_LT(std::abs(outwards_px(GetParam().change, side_px)), 0.03) << side_px;
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds,
                         EdgesOfMarkers,
                         ::testing::Values(Imaging{"AsTheyAre",
                                                   [](const cv::Mat& image) { return image; }},
                                           // 0.09 px on the dark side, uncorrected.
                                           Imaging{"Overexposed",
                                                   [](const cv::Mat& image) {
                                                     return through_light(image, [](double light) {
                                                       return 1.6 * light;
                                                     });
                                                   }},
                                           // 0.25 px on the light side, uncorrected.
                                           Imaging{"BlurredAfterTheToneCurve",
                                                   [](const cv::Mat& image) {
                                                     cv::Mat blurred;
                                                     cv::GaussianBlur(image, blurred, {}, 0.7);
                                                     return blurred;
                                                   }},
                                           Imaging{"OfAnotherToneCurve",
                                                   [](const cv::Mat& image) {
                                                     return through_light(image, [](double light) {
                                                       return std::pow(light, 0.7);
                                                     });
                                                   }}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(EdgeShift, NeedsEnoughEdges) {
  const cv::Mat flat(100, 100, CV_32FC1, cv::Scalar(40.0));
  const ReadMarker marker{
      {Eigen::Vector2d(20.0, 20.0), {60.0, 20.0}, {60.0, 60.0}, {20.0, 60.0}}, 0x9A5C, 4};
  EXPECT_FALSE(edge_shift_px(flat, {marker}));
  EXPECT_FALSE(edge_shift_px(flat, {}));
}

TEST(EdgeShift, MovesSidesOutwards) {
  const Quad quad{Eigen::Vector2d(10.0, 10.0), {50.0, 12.0}, {55.0, 40.0}, {8.0, 45.0}};
  const Quad moved = moved_outwards(quad, 0.3);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d along = (quad[(i + 1) % 4] - quad[i]).normalized();
    const Eigen::Vector2d outward(along.y(), -along.x());
    EXPECT_NEAR(outward.dot(moved[i] - quad[i]), 0.3, 1e-12);
    EXPECT_NEAR(outward.dot(moved[(i + 1) % 4] - quad[i]), 0.3, 1e-12);
  }
}

}  // namespace
}  // namespace trigmesh
