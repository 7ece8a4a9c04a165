#include "tests/unit/sfm/moving/moving_scene.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "tests/support/textured_image.hpp"

namespace trigmesh::test {

namespace {

constexpr double kWallDepth = 4.0;
constexpr double kPlateDepth = 3.0;
constexpr double kHalfPlate = 0.45;
constexpr double kTexelsPerUnit = 90.0;
constexpr std::size_t kSpecialView = 2;

Camera camera() {
  return {.model = CameraModel::kPinhole,
          .width_px = 320,
          .height_px = 240,
          .fx_px = 300.0,
          .fy_px = 300.0,
          .cx_px = 159.5,
          .cy_px = 119.5,
          .distortion = {}};
}

/// A picture on a plane, grey with a tint.
class Picture {
 public:
  Picture(std::uint64_t seed, cv::Vec3d tint)
      : grey_(test_support::textured_image(900, 700, seed)), tint_(tint) {}

  [[nodiscard]] cv::Vec3d at(double x, double y) const {
    const double u = std::clamp(x * kTexelsPerUnit + 450.0, 0.0, 898.0);
    const double v = std::clamp(y * kTexelsPerUnit + 350.0, 0.0, 698.0);
    const int column = static_cast<int>(u);
    const int row = static_cast<int>(v);
    const auto pixel = [&](int i, int j) {
      return static_cast<double>(grey_.at<std::uint8_t>(row + j, column + i));
    };
    const double a = u - column;
    const double b = v - row;
    return tint_ * ((1.0 - b) * ((1.0 - a) * pixel(0, 0) + a * pixel(1, 0)) +
                    b * ((1.0 - a) * pixel(0, 1) + a * pixel(1, 1)));
  }

 private:
  cv::Mat grey_;
  cv::Vec3d tint_;
};

/// Middle of the board in world coordinates; nothing hidden in it: views stand on the x axis.
cv::Point2d plate_center(PlateKind kind, std::size_t view) {
  constexpr std::array<std::array<double, 2>, 7> kPlaces{
      {{-0.7, 0.3}, {0.6, -0.4}, {0.0, 0.4}, {-0.5, -0.3}, {0.8, 0.2}, {0.2, -0.5}, {-0.2, 0.1}}};
  if (kind == PlateKind::kPlainStanding) {
    return {0.1, 0.0};
  }
  const auto& place = kPlaces[view % kPlaces.size()];
  return {place[0], place[1]};
}

bool has_plate(PlateKind kind, std::size_t view) {
  return kind != PlateKind::kNone && (kind != PlateKind::kPlainOnce || view == kSpecialView);
}

}  // namespace

MovingScene make_moving_scene(const MovingSceneOptions& options) {
  const Picture wall(11, {0.9, 1.0, 0.8});
  const Picture board(12, {1.0, 0.5, 0.9});
  MovingScene scene;
  for (std::size_t i = 0; i < options.views; ++i) {
    const double x_of_camera = 0.25 * (static_cast<double>(i) - 3.0);
    MovingView view;
    view.camera = camera();
    view.cam_from_world.translation = {-x_of_camera, 0.0, 0.0};
    view.min_depth = 2.0F;
    view.rgb = cv::Mat(240, 320, CV_8UC3);
    view.depth = cv::Mat(240, 320, CV_32FC1, cv::Scalar(kWallDepth));
    cv::Mat truth(240, 320, CV_8UC1, cv::Scalar(0));
    const cv::Point2d center = plate_center(options.plate, i);
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        const double u = (x - view.camera.cx_px) / view.camera.fx_px;
        const double v = (y - view.camera.cy_px) / view.camera.fy_px;
        cv::Vec3d color = wall.at(u * kWallDepth + x_of_camera, v * kWallDepth);
        const double px = u * kPlateDepth + x_of_camera - center.x;
        const double py = v * kPlateDepth - center.y;
        if (has_plate(options.plate, i) && std::max(std::abs(px), std::abs(py)) < kHalfPlate) {
          color = options.plate == PlateKind::kTextured ? board.at(px, py)
                                                        : cv::Vec3d(250.0, 30.0, 30.0);
          truth.at<std::uint8_t>(y, x) = 255;
          view.depth.at<float>(y, x) = 0.0F;
        }
        color *= i == kSpecialView ? options.exposure : 1.0;
        for (int c = 0; c < 3; ++c) {
          view.rgb.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<std::uint8_t>(color[c]);
        }
      }
    }
    for (std::size_t n = 0; n < options.views; ++n) {
      if (n != i) {
        view.neighbors.push_back(n);
      }
    }
    scene.views.push_back(std::move(view));
    scene.truth.push_back(std::move(truth));
  }
  return scene;
}

double recall(const cv::Mat& mask, const cv::Mat& truth) {
  return mask.empty() ? 0.0
                      : static_cast<double>(cv::countNonZero(mask & truth)) /
                            std::max(1, cv::countNonZero(truth));
}

double precision(const cv::Mat& mask, const cv::Mat& truth) {
  return mask.empty() ? 0.0
                      : static_cast<double>(cv::countNonZero(mask & truth)) /
                            std::max(1, cv::countNonZero(mask));
}

}  // namespace trigmesh::test
