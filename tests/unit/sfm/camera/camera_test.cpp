#include "sfm/camera/camera.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

Camera make_camera(CameraModel model) {
  Camera camera{.model = model,
                .width_px = 1600,
                .height_px = 1200,
                .fx_px = 1210.0,
                .fy_px = 1195.0,
                .cx_px = 801.5,
                .cy_px = 590.25};
  switch (model) {
    case CameraModel::kPinhole:
      break;
    case CameraModel::kRadial:
      camera.distortion = {-0.21, 0.07, 0.0, 0.0};
      break;
    case CameraModel::kBrownConrady:
      camera.distortion = {-0.21, 0.07, 0.0012, -0.0007};
      break;
    case CameraModel::kKannalaBrandt:
      camera.fx_px = 480.0;
      camera.fy_px = 476.0;
      camera.distortion = {0.021, -0.011, 0.004, -0.0006};
      break;
  }
  return camera;
}

std::string model_name(const testing::TestParamInfo<CameraModel>& info) {
  return std::string(to_string(info.param));
}

class EveryCameraModel : public testing::TestWithParam<CameraModel> {};

INSTANTIATE_TEST_SUITE_P(Models,
                         EveryCameraModel,
                         testing::Values(CameraModel::kPinhole,
                                         CameraModel::kRadial,
                                         CameraModel::kBrownConrady,
                                         CameraModel::kKannalaBrandt),
                         model_name);

void expect_derivatives_match_differences(const Camera& camera, const Eigen::Vector3d& point) {
  const auto analytic = project_with_derivatives(camera, point);
  ASSERT_TRUE(analytic);
  EXPECT_EQ(analytic->pixel, *project(camera, point));
  const double step = 1e-6 * point.norm();
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d delta = step * Eigen::Vector3d::Unit(i);
    const Eigen::Vector2d numeric =
        (*project(camera, point + delta) - *project(camera, point - delta)) / (2.0 * step);
    const double scale = camera.fx_px / point.norm();
    EXPECT_NEAR((numeric - analytic->d_point.col(i)).norm() / scale, 0.0, 1e-6)
        << "coordinate " << i;
  }
  for (int i = 0; i < kIntrinsicsCount; ++i) {
    Camera more = camera;
    Camera less = camera;
    const double delta = i < 4 ? 1e-3 : 1e-6;
    more.set_intrinsics(camera.intrinsics() + delta * IntrinsicsVector::Unit(i));
    less.set_intrinsics(camera.intrinsics() - delta * IntrinsicsVector::Unit(i));
    const Eigen::Vector2d numeric = (*project(more, point) - *project(less, point)) / (2.0 * delta);
    const bool unused = i >= 4 + distortion_count(camera.model);
    const Eigen::Vector2d column = analytic->d_intrinsics.col(i);
    if (unused) {
      EXPECT_EQ(column.norm(), 0.0) << "intrinsic " << i;
    } else {
      EXPECT_NEAR((numeric - column).norm(), 0.0, 1e-6 * (1.0 + column.norm()))
          << "intrinsic " << i;
    }
  }
}

TEST_P(EveryCameraModel, DerivativesEqualNumericDifferences) {
  const Camera camera = make_camera(GetParam());
  std::mt19937 random(7);
  std::uniform_real_distribution<double> lateral(-0.6, 0.6);
  for (int i = 0; i < 200; ++i) {
    const double depth = std::exp2(lateral(random) * 6.0);
    const Eigen::Vector3d point(lateral(random) * depth, lateral(random) * depth, depth);
    expect_derivatives_match_differences(camera, point);
  }
}

TEST_P(EveryCameraModel, DerivativesHoldOnAndBesideTheAxis) {
  const Camera camera = make_camera(GetParam());
  for (const double offset : {0.0, 1e-12, 1e-8, 1e-5, 0.9e-4, 1.1e-4, 1e-3}) {
    expect_derivatives_match_differences(camera, {2.0 * offset, -1.3 * offset, 2.0});
  }
}

TEST_P(EveryCameraModel, PixelsReturnToTheirRay) {
  const Camera camera = make_camera(GetParam());
  std::mt19937 random(11);
  std::uniform_real_distribution<double> lateral(-0.65, 0.65);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d uv(lateral(random), lateral(random));
    const auto pixel = project(camera, 3.7 * Eigen::Vector3d(uv.homogeneous()));
    ASSERT_TRUE(pixel);
    const auto back = normalize_pixel(camera, *pixel);
    ASSERT_TRUE(back) << uv.transpose();
    EXPECT_NEAR((*back - uv).norm(), 0.0, 1e-12);
  }
}

TEST_P(EveryCameraModel, RaysReturnToTheirPixelAllOverTheImage) {
  const Camera camera = make_camera(GetParam());
  for (int y = 0; y < camera.height_px; y += 50) {
    for (int x = 0; x < camera.width_px; x += 50) {
      const Eigen::Vector2d pixel(x, y);
      const auto uv = normalize_pixel(camera, pixel);
      if (camera.model == CameraModel::kKannalaBrandt && !uv) {
        continue;  // corners lie beyond 90 degrees
      }
      ASSERT_TRUE(uv) << pixel.transpose();
      EXPECT_NEAR((*project(camera, uv->homogeneous()) - pixel).norm(), 0.0, 1e-9);
    }
  }
}

TEST_P(EveryCameraModel, PrincipalPointIsTheAxis) {
  const Camera camera = make_camera(GetParam());
  const Eigen::Vector2d principal(camera.cx_px, camera.cy_px);
  EXPECT_EQ(*project(camera, {0.0, 0.0, 4.0}), principal);
  EXPECT_EQ(*normalize_pixel(camera, principal), Eigen::Vector2d::Zero());
}

TEST_P(EveryCameraModel, CentreAndStraightBehindHaveNoPixel) {
  const Camera camera = make_camera(GetParam());
  EXPECT_FALSE(project(camera, Eigen::Vector3d::Zero()));
  EXPECT_FALSE(project(camera, {0.0, 0.0, -1.0}));
  EXPECT_FALSE(project_with_derivatives(camera, Eigen::Vector3d::Zero()));
  EXPECT_FALSE(project_with_derivatives(camera, {0.0, 0.0, -1.0}));
}

TEST_P(EveryCameraModel, NotFiniteInHasNothingOut) {
  const Camera camera = make_camera(GetParam());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(project(camera, {nan, 0.0, 1.0}));
  EXPECT_FALSE(project(camera, {inf, 0.0, 1.0}));
  EXPECT_FALSE(project_with_derivatives(camera, {0.0, nan, 1.0}));
  EXPECT_FALSE(normalize_pixel(camera, {nan, 0.0}));
  EXPECT_FALSE(normalize_pixel(camera, {0.0, inf}));
}

TEST_P(EveryCameraModel, NameRoundTrips) {
  EXPECT_EQ(camera_model_from_string(to_string(GetParam())), GetParam());
}

TEST_P(EveryCameraModel, IntrinsicsRoundTripInTheirOrder) {
  const Camera camera = make_camera(GetParam());
  Camera copy = make_camera(GetParam());
  IntrinsicsVector values;
  values << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0;
  copy.set_intrinsics(values);
  EXPECT_EQ(copy.intrinsics(), values);
  EXPECT_EQ(copy.fy_px, 2.0);
  EXPECT_EQ(copy.cx_px, 3.0);
  EXPECT_EQ(copy.distortion[0], 5.0);
  copy.set_intrinsics(camera.intrinsics());
  EXPECT_EQ(copy, camera);
}

TEST(Camera, PinholeFollowsTheCalibrationMatrix) {
  const Camera camera = make_camera(CameraModel::kPinhole);
  const Eigen::Vector3d point(0.4, -0.7, 2.5);
  const Eigen::Vector2d expected = (camera.calibration_matrix() * point).hnormalized();
  EXPECT_NEAR((*project(camera, point) - expected).norm(), 0.0, 1e-12);
}

TEST(Camera, BehindAPlaneModelHasNoPixel) {
  for (const auto model :
       {CameraModel::kPinhole, CameraModel::kRadial, CameraModel::kBrownConrady}) {
    EXPECT_FALSE(project(make_camera(model), {0.3, 0.2, -1.0}));
    EXPECT_FALSE(project(make_camera(model), {0.3, 0.2, 0.0}));
  }
}

TEST(Camera, BrownConradyAgreesWithHandComputedValue) {
  Camera camera = make_camera(CameraModel::kBrownConrady);
  camera.distortion = {0.1, 0.01, 0.001, 0.002};
  // u = .5, v = -.25: r2 = .3125, L = 1.0322265625, 2uv = -.25
  const double u = 0.5 * 1.0322265625 + 0.001 * -0.25 + 0.002 * (0.3125 + 0.5);
  const double v = -0.25 * 1.0322265625 + 0.001 * (0.3125 + 0.125) + 0.002 * -0.25;
  const auto pixel = project(camera, {1.0, -0.5, 2.0});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 1210.0 * u + 801.5, 1e-9);
  EXPECT_NEAR(pixel->y(), 1195.0 * v + 590.25, 1e-9);
}

TEST(Camera, FisheyeSeesBesideAndBehindButHasNoPlaneCoordinatesThere) {
  Camera camera = make_camera(CameraModel::kKannalaBrandt);
  camera.distortion = {};
  const auto beside = project(camera, {3.0, 0.0, 0.0});
  ASSERT_TRUE(beside);
  EXPECT_NEAR(beside->x() - camera.cx_px, camera.fx_px * std::numbers::pi / 2.0, 1e-9);
  ASSERT_TRUE(project(camera, {1.0, 1.0, -1.0}));
  expect_derivatives_match_differences(camera, {1.0, 0.5, -1.0});
  expect_derivatives_match_differences(camera, {1.0, 0.5, 0.0});
  EXPECT_FALSE(normalize_pixel(camera, *beside));
  EXPECT_FALSE(normalize_pixel(camera, *project(camera, {1.0, 1.0, -1.0})));
  EXPECT_TRUE(normalize_pixel(camera, *project(camera, {1.0, 1.0, 0.01})));
}

TEST(Camera, PixelBeyondTheFoldOfTheLensHasNoRay) {
  // r (1 - r^2 / 3) is largest at r = 1 with value 2/3.
  for (const auto model : {CameraModel::kRadial, CameraModel::kBrownConrady}) {
    Camera camera = make_camera(model);
    camera.distortion = {-1.0 / 3.0, 0.0, 0.0, 0.0};
    const auto at = [&](double u) {
      return Eigen::Vector2d(camera.cx_px + camera.fx_px * u, camera.cy_px);
    };
    EXPECT_FALSE(normalize_pixel(camera, at(0.67)));
    EXPECT_FALSE(normalize_pixel(camera, at(5.0)));
    const auto inside = normalize_pixel(camera, at(0.6));
    ASSERT_TRUE(inside);
    EXPECT_LT(inside->x(), 1.0);
    EXPECT_NEAR(inside->x() * (1.0 - inside->x() * inside->x() / 3.0), 0.6, 1e-12);
  }
}

TEST(Camera, RootOnAFartherBranchIsNotTakenForTheRay) {
  // 1 + k1 r^2 + k2 r^4 with a fold: r = 0.6 .. falls and rises again; the pixel is met only on the
  // second rise.
  Camera camera = make_camera(CameraModel::kRadial);
  camera.distortion = {-1.0, 0.3, 0.0, 0.0};
  const double fold2 = (3.0 - std::sqrt(9.0 - 6.0)) / 3.0;  // 1 - 3 t + 1.5 t^2 = 0
  const double fold = std::sqrt(fold2);
  const double highest = fold * (1.0 + fold2 * (-1.0 + 0.3 * fold2));
  EXPECT_FALSE(
      normalize_pixel(camera, {camera.cx_px + camera.fx_px * (highest + 0.05), camera.cy_px}));
  const auto inside =
      normalize_pixel(camera, {camera.cx_px + camera.fx_px * (highest - 0.01), camera.cy_px});
  ASSERT_TRUE(inside);
  EXPECT_LT(inside->x(), fold);
}

TEST(Camera, StrongRandomLensesNeverGiveAWrongRay) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coefficient(-0.8, 0.8);
  std::uniform_real_distribution<double> position(0.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    Camera camera = make_camera(static_cast<CameraModel>(1 + i % 3));
    for (auto& value : camera.distortion) {
      value = coefficient(random) * (camera.model == CameraModel::kBrownConrady ? 0.3 : 1.0);
    }
    const Eigen::Vector2d pixel(position(random) * camera.width_px,
                                position(random) * camera.height_px);
    const auto uv = normalize_pixel(camera, pixel);
    if (uv) {
      const auto again = project(camera, uv->homogeneous());
      ASSERT_TRUE(again);
      EXPECT_NEAR((*again - pixel).norm(), 0.0, 1e-8);
    }
  }
}

TEST(Camera, ValidateNamesWhatIsWrong) {
  const Camera good = make_camera(CameraModel::kBrownConrady);
  EXPECT_TRUE(good.validate());
  const auto error_of = [](const Camera& camera) {
    const auto result = camera.validate();
    EXPECT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
    return result.error().message;
  };
  Camera bad = good;
  bad.width_px = 0;
  EXPECT_NE(error_of(bad).find("0 x 1200"), std::string::npos);
  bad = good;
  bad.fy_px = -3.0;
  EXPECT_NE(error_of(bad).find("fy_px=-3"), std::string::npos);
  bad = good;
  bad.fx_px = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(bad.validate());
  bad = good;
  bad.cx_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(error_of(bad).find("principal point"), std::string::npos);
  bad = good;
  bad.distortion[3] = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(bad.validate());
}

TEST(Camera, UnknownModelNameIsRefused) {
  EXPECT_FALSE(camera_model_from_string("Pinhole"));
  EXPECT_FALSE(camera_model_from_string(""));
}

}  // namespace
}  // namespace trigmesh
