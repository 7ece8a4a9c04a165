#include "sfm/dense/undistortion.hpp"

#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

Camera lens(CameraModel model, std::array<double, 4> distortion) {
  return {.model = model,
          .width_px = 120,
          .height_px = 80,
          .fx_px = 90.0,
          .fy_px = 92.0,
          .cx_px = 58.0,
          .cy_px = 41.0,
          .distortion = distortion};
}

/// Grey equals the normalised coordinates of the ray: a picture of a ramp at infinity.
ViewImage ramp_through(const Camera& camera) {
  ViewImage image;
  image.rgb = cv::Mat(camera.height_px, camera.width_px, CV_8UC3);
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const auto ray = normalize_pixel(camera, Eigen::Vector2d(x, y));
      const double u = ray ? ray->x() : 0.0;
      const double v = ray ? ray->y() : 0.0;
      image.rgb.at<cv::Vec3b>(y, x) =
          cv::Vec3b(static_cast<std::uint8_t>(std::lround(128.0 + 120.0 * u)),
                    static_cast<std::uint8_t>(std::lround(128.0 + 120.0 * v)),
                    7);
    }
  }
  return image;
}

TEST(Undistortion, PinholePixelsPassThroughUntouched) {
  const Camera camera = lens(CameraModel::kPinhole, {});
  EXPECT_EQ(undistorted_camera(camera), camera);
  const ViewImage image = ramp_through(camera);
  const Result<ViewImage> out = undistort_image(image, camera, camera);
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->rgb.data, image.rgb.data);
  EXPECT_TRUE(out->mask.empty());
}

TEST(Undistortion, RaysComeOutStraight) {
  for (const Camera& camera : {lens(CameraModel::kRadial, {-0.2, 0.05, 0.0, 0.0}),
                               lens(CameraModel::kBrownConrady, {0.1, -0.02, 0.003, -0.002}),
                               lens(CameraModel::kKannalaBrandt, {0.02, -0.01, 0.0, 0.0})}) {
    const Camera pinhole = undistorted_camera(camera);
    EXPECT_EQ(pinhole.model, CameraModel::kPinhole);
    EXPECT_LE(pinhole.width_px, 181);
    const Result<ViewImage> out = undistort_image(ramp_through(camera), camera, pinhole);
    ASSERT_TRUE(out.has_value());
    int seen = 0;
    for (int y = 0; y < pinhole.height_px; ++y) {
      for (int x = 0; x < pinhole.width_px; ++x) {
        if (out->mask.at<std::uint8_t>(y, x) != 0) {
          ++seen;
          const double u = (x - pinhole.cx_px) / pinhole.fx_px;
          EXPECT_NEAR(out->rgb.at<cv::Vec3b>(y, x)[0], 128.0 + 120.0 * u, 1.6);
        }
      }
    }
    EXPECT_GT(seen, 120 * 80 * 8 / 10);
  }
}

TEST(Undistortion, MasksFollowTheirPixels) {
  const Camera camera = lens(CameraModel::kRadial, {-0.2, 0.05, 0.0, 0.0});
  ViewImage image = ramp_through(camera);
  image.mask = cv::Mat(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar(255));
  image.mask.colRange(0, 58).setTo(0);
  const Camera pinhole = undistorted_camera(camera);
  const Result<ViewImage> out = undistort_image(image, camera, pinhole);
  ASSERT_TRUE(out.has_value());
  const int row = pinhole.height_px / 2;
  const int center = static_cast<int>(pinhole.cx_px);
  EXPECT_EQ(out->mask.at<std::uint8_t>(row, center - 5), 0);
  EXPECT_EQ(out->mask.at<std::uint8_t>(row, center + 5), 255);
}

TEST(Undistortion, MasksFindTheWayBack) {
  const Camera camera = lens(CameraModel::kRadial, {-0.2, 0.05, 0.0, 0.0});
  const Camera pinhole = undistorted_camera(camera);
  cv::Mat mask(pinhole.height_px, pinhole.width_px, CV_8UC1, cv::Scalar(0));
  mask(cv::Rect(10, 10, 30, 20)).setTo(255);
  const Result<cv::Mat> back = distort_mask(mask, pinhole, camera, 7);
  ASSERT_TRUE(back.has_value());
  ASSERT_EQ(back->size(), cv::Size(camera.width_px, camera.height_px));
  int differing = 0;
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const auto pixel = project(
          camera, {(x - pinhole.cx_px) / pinhole.fx_px, (y - pinhole.cy_px) / pinhole.fy_px, 1.0});
      const cv::Point at(static_cast<int>(std::lround(pixel->x())),
                         static_cast<int>(std::lround(pixel->y())));
      if (cv::Rect(0, 0, camera.width_px, camera.height_px).contains(at)) {
        differing += back->at<std::uint8_t>(at) != mask.at<std::uint8_t>(y, x) ? 1 : 0;
      }
    }
  }
  EXPECT_LT(differing, 2 * (30 + 20)) << "only the border may round to the other side";
  EXPECT_EQ(distort_mask(mask, camera, camera, 0).error().code, ErrorCode::kInvalidArgument);
}

TEST(Undistortion, RefusesPicturesOfAnotherSize) {
  const Camera camera = lens(CameraModel::kPinhole, {});
  const ViewImage image{.rgb = cv::Mat(10, 10, CV_8UC3), .mask = {}};
  EXPECT_EQ(undistort_image(image, camera, camera).error().code, ErrorCode::kInvalidArgument);
}

TEST(Undistortion, ScalingKeepsTheEdgesOfThePicture) {
  const Camera camera = lens(CameraModel::kPinhole, {});
  const Camera half = scaled_pinhole(camera, 60, 40);
  // The left edge of the picture, x = -0.5, is the left edge at every size.
  EXPECT_DOUBLE_EQ((-0.5 - half.cx_px) / half.fx_px, (-0.5 - camera.cx_px) / camera.fx_px);
  EXPECT_DOUBLE_EQ((59.5 - half.cx_px) / half.fx_px, (119.5 - camera.cx_px) / camera.fx_px);
}

TEST(Undistortion, OnlyRegisteredViewsBecomeDenseViews) {
  Scene scene;
  scene.cameras.push_back(lens(CameraModel::kRadial, {-0.2, 0.05, 0.0, 0.0}));
  scene.views.resize(3);
  scene.views[2].name = "c.jpg";
  scene.views[2].cam_from_world = Rigid3{};
  const std::vector<DenseView> views = dense_views(scene);
  ASSERT_EQ(views.size(), 1U);
  EXPECT_EQ(views[0].name, "c.jpg");
  EXPECT_EQ(views[0].source, ViewId{2});
  EXPECT_EQ(views[0].camera.model, CameraModel::kPinhole);
}

}  // namespace
}  // namespace trigmesh
