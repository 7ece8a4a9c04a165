#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <gtest/gtest.h>

#include "sfm/surface/surface.hpp"

namespace trigmesh {
namespace {

/// Where a ray from `origin` along `direction` first meets the scene, with the outward normal
/// there.
struct Hit {
  double along = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

using Scene3d = Hit (*)(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

Hit sphere(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const double a = direction.squaredNorm();
  const double b = origin.dot(direction);
  const double under = b * b - a * (origin.squaredNorm() - 0.25);
  if (under < 0.0) {
    return {};
  }
  const double along = (-b - std::sqrt(under)) / a;
  return {along, (origin + along * direction).normalized()};
}

/// A plate |x|, |y| <= 0.5 of thickness 0.08, seen through at its sides.
Hit plate(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const double side = origin.z() > 0.0 ? 1.0 : -1.0;
  const double along = (side * 0.04 - origin.z()) / direction.z();
  const Eigen::Vector3d at = origin + along * direction;
  if (along <= 0.0 || std::max(std::abs(at.x()), std::abs(at.y())) > 0.5) {
    return {};
  }
  return {along, side * Eigen::Vector3d::UnitZ()};
}

DenseView looking_at_origin(const Eigen::Vector3d& center) {
  DenseView view;
  view.camera = {.model = CameraModel::kPinhole,
                 .width_px = 80,
                 .height_px = 80,
                 .fx_px = 90.0,
                 .fy_px = 90.0,
                 .cx_px = 39.5,
                 .cy_px = 39.5};
  const Eigen::Vector3d z = -center.normalized();
  const Eigen::Vector3d x =
      z.cross(std::abs(z.z()) > 0.9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ())
          .normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  view.cam_from_world.rotation = Eigen::Quaterniond(rotation);
  view.cam_from_world.translation = -(rotation * center);
  return view;
}

/// Exact depth maps of a scene; one view may hold a false surface in front.
class RenderedMaps final : public DepthMapSource {
 public:
  RenderedMaps(Scene3d scene, const std::vector<DenseView>& views) : scene_(scene), views_(views) {}

  /// The middle of the depth map of this view lies this much nearer to the camera.
  std::optional<std::size_t> wrong_view;

  [[nodiscard]] Result<DepthMap> load(std::size_t view) const override {
    const DenseView& v = views_[view];
    const Rigid3 world_from_cam = v.cam_from_world.inverse();
    DepthMap map{v.camera,
                 cv::Mat::zeros(80, 80, CV_32FC1),
                 cv::Mat::zeros(80, 80, CV_32FC3),
                 cv::Mat::zeros(80, 80, CV_8UC1)};
    for (int y = 0; y < 80; ++y) {
      for (int x = 0; x < 80; ++x) {
        const Eigen::Vector3d ray((x - 39.5) / 90.0, (y - 39.5) / 90.0, 1.0);
        const Hit hit = scene_(world_from_cam.translation, world_from_cam.rotation * ray);
        if (!std::isfinite(hit.along)) {
          continue;
        }
        const Eigen::Vector3d n = v.cam_from_world.rotation * hit.normal;
        const bool wrong = wrong_view == view && std::hypot(x - 39.5, y - 39.5) < 8.0;
        map.depth.at<float>(y, x) = static_cast<float>(hit.along - (wrong ? 0.4 : 0.0));
        map.normal.at<cv::Vec3f>(y, x) = cv::Vec3f(
            static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z()));
        map.confidence.at<std::uint8_t>(y, x) = 255;
      }
    }
    return map;
  }

 private:
  Scene3d scene_;
  const std::vector<DenseView>& views_;
};

class RedImages final : public ViewImageSource {
 public:
  [[nodiscard]] Result<ViewImage> load(std::size_t /*view*/) const override {
    return ViewImage{cv::Mat(80, 80, CV_8UC3, cv::Scalar(200, 10, 20)), {}};
  }
};

/// From the last index to the first.
class ReversedExecutor final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    for (std::size_t i = count; i-- > 0;) {
      work(i);
    }
  }
};

std::vector<DenseView> views_around() {
  std::vector<DenseView> views;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x != 0 || y != 0 || z != 0) {
          views.push_back(looking_at_origin(2.0 * Eigen::Vector3d(x, y, z).normalized()));
        }
      }
    }
  }
  return views;
}

class MakeSurface : public testing::Test {
 protected:
  Result<SurfaceResult> make(const RenderedMaps& maps, const SurfaceOptions& options) {
    SerialExecutor serial;
    return make_surface({views_, &maps, &images_}, options, serial);
  }

  std::vector<DenseView> views_ = views_around();
  RedImages images_;
};

TEST_F(MakeSurface, OfASphereIsClosedColouredAndInPlace) {
  const auto result = make(RenderedMaps(sphere, views_), {.voxel_size = 0.04});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->report.non_manifold_edges, 0U);
  EXPECT_EQ(result->report.open_hole_count, 0U);
  EXPECT_EQ(result->report.view_count, 26U);
  ASSERT_GT(result->mesh.positions.size(), 300U);
  for (std::size_t v = 0; v < result->mesh.positions.size(); ++v) {
    EXPECT_NEAR(result->mesh.positions[v].norm(), 0.5F, 0.012F);
    EXPECT_GT(result->mesh.normals[v].dot(result->mesh.positions[v].normalized()), 0.9F);
    EXPECT_EQ(result->mesh.colors[v], (std::array<std::uint8_t, 3>{200, 10, 20}));
  }
}

TEST_F(MakeSurface, KeepsBothSidesOfAThinPlate) {
  const auto result = make(RenderedMaps(plate, views_), {.voxel_size = 0.03});
  ASSERT_TRUE(result) << result.error().message;
  int front = 0;
  int back = 0;
  for (const Eigen::Vector3f& p : result->mesh.positions) {
    if (p.head<2>().cwiseAbs().maxCoeff() < 0.4F) {
      EXPECT_NEAR(std::abs(p.z()), 0.04F, 0.01F);
      ++(p.z() > 0.0F ? front : back);
    }
  }
  EXPECT_GT(front, 300);
  EXPECT_GT(back, 300);
}

TEST_F(MakeSurface, CarvesAwayWhatOtherViewsSeeThrough) {
  RenderedMaps maps(sphere, views_);
  maps.wrong_view = 4;
  const auto result = make(maps, {.voxel_size = 0.04});
  ASSERT_TRUE(result) << result.error().message;
  for (const Eigen::Vector3f& p : result->mesh.positions) {
    EXPECT_LT(p.norm(), 0.53F);
  }
}

TEST_F(MakeSurface, IsTheSameInAnyOrderOfWork) {
  const RenderedMaps maps(sphere, views_);
  ReversedExecutor reversed;
  const auto forward = make(maps, {.voxel_size = 0.05});
  const auto backward = make_surface({views_, &maps, &images_}, {.voxel_size = 0.05}, reversed);
  ASSERT_TRUE(forward && backward);
  EXPECT_EQ(forward->mesh.positions, backward->mesh.positions);
  EXPECT_EQ(forward->mesh.normals, backward->mesh.normals);
  EXPECT_EQ(forward->mesh.colors, backward->mesh.colors);
  EXPECT_EQ(forward->mesh.faces, backward->mesh.faces);
}

TEST_F(MakeSurface, IsTheSameInOneTileAndInMany) {
  const RenderedMaps maps(sphere, views_);
  const auto whole = make(maps, {.voxel_size = 0.01});
  const auto tiled = make(maps, {.voxel_size = 0.01, .max_tile_bytes = std::size_t{2} << 20U});
  ASSERT_TRUE(whole && tiled);
  EXPECT_EQ(whole->report.tile_count, 1U);
  EXPECT_GT(tiled->report.tile_count, 3U);
  EXPECT_EQ(tiled->report.memory_steps, 0);
  EXPECT_LT(tiled->report.grid_bytes, whole->report.grid_bytes);
  EXPECT_EQ(whole->mesh.positions, tiled->mesh.positions);
  EXPECT_EQ(whole->mesh.normals, tiled->mesh.normals);
  EXPECT_EQ(whole->mesh.colors, tiled->mesh.colors);
  EXPECT_EQ(whole->mesh.faces, tiled->mesh.faces);
  EXPECT_EQ(tiled->report.non_manifold_edges, 0U);
}

TEST_F(MakeSurface, TakesLargerVoxelsWhenTheMeshDoesNotFit) {
  const auto result = make(RenderedMaps(sphere, views_),
                           {.voxel_size = 0.007, .max_memory_bytes = std::size_t{4} << 20U});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_GT(result->report.memory_steps, 0);
  EXPECT_NEAR(result->report.voxel_size,
              0.007 * std::pow(kVoxelGrowthRatio, result->report.memory_steps),
              1e-9);
  EXPECT_LE(result->report.grid_bytes, std::size_t{4} << 20U);
}

TEST_F(MakeSurface, RefusesOptionsByName) {
  const auto result = make(RenderedMaps(sphere, views_), {.truncation_voxels = 0.5});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(result.error().message.find("truncation_voxels"), std::string::npos);
}

}  // namespace
}  // namespace trigmesh
