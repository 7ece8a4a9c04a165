#include "sfm/texture/texture_surface.hpp"

#include <optional>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "sfm/texture/image_similarity.hpp"
#include "sfm/texture/textured_render.hpp"
#include "tests/unit/sfm/texture/painted_scene.hpp"

namespace trigmesh {
namespace {

/// Calls in reverse order, as another thread might.
class ReverseExecutor final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    for (std::size_t i = count; i > 0; --i) {
      work(i - 1);
    }
  }
};

/// How well the textured mesh looks like the paint from a view that was not used.
double psnr_from(const TexturedMesh& textured, const Eigen::Vector3d& eye, const RayColor& truth) {
  PaintedScene held_out;
  held_out.add_view(eye, truth);
  const RenderedView rendered =
      render_textured(textured, held_out.views[0].camera, held_out.views[0].cam_from_world);
  const ImageSimilarity similarity =
      compare_images(rendered.rgb, held_out.images.pictures[0].rgb, rendered.coverage);
  EXPECT_GT(similarity.pixel_count, 500U);
  return similarity.psnr_db;
}

TextureResult texture(const TriangleMesh& mesh, const PaintedScene& scene) {
  SerialExecutor executor;
  auto result = texture_surface(mesh, scene.views, scene.images, {}, executor);
  EXPECT_TRUE(result.has_value()) << result.error().message;
  return std::move(*result);
}

TEST(TextureSurface, PaintedPlaneLooksLikeThePaint) {
  PaintedScene scene;
  add_ring(scene, 6);
  const TextureResult result = texture(square_mesh(0.6, 8, 0.0), scene);
  EXPECT_EQ(result.report.textured_face_count, result.report.face_count);
  EXPECT_GT(psnr_from(result.textured, {0.1, -0.2, 2.0}, ground_color), 42.0);
}

TEST(TextureSurface, PaintedSphereLooksLikeThePaint) {
  TriangleMesh sphere;
  constexpr int kRings = 24;
  for (int ring = 0; ring <= kRings; ++ring) {
    for (int i = 0; i < 2 * kRings; ++i) {
      const double polar = 3.14159265358979 * ring / kRings;
      const double around = 3.14159265358979 * i / kRings;
      sphere.positions.push_back(0.5F * Eigen::Vector3d(std::sin(polar) * std::cos(around),
                                                        std::sin(polar) * std::sin(around),
                                                        std::cos(polar))
                                            .cast<float>());
    }
  }
  const auto index = [](int ring, int i) {
    return static_cast<std::uint32_t>(ring * 2 * kRings + i % (2 * kRings));
  };
  for (int ring = 0; ring < kRings; ++ring) {
    for (int i = 0; i < 2 * kRings; ++i) {
      sphere.faces.push_back({index(ring, i), index(ring + 1, i), index(ring + 1, i + 1)});
      sphere.faces.push_back({index(ring, i), index(ring + 1, i + 1), index(ring, i + 1)});
    }
  }
  const RayColor ball = [](const Eigen::Vector3d& eye, const Eigen::Vector3d& ray) {
    const double along = -eye.dot(ray);
    const double inside = along * along - eye.squaredNorm() + 0.25;
    return inside > 0.0 ? paint(eye + ray * (along - std::sqrt(inside)))
                        : Eigen::Vector3d(255.0, 0.0, 255.0);  // must not bleed in
  };
  PaintedScene scene;
  for (int i = 0; i < 8; ++i) {
    scene.add_view({2.0 * std::cos(0.785 * i), 2.0 * std::sin(0.785 * i), i % 2 == 0 ? 0.6 : -0.6},
                   ball);
  }
  const TextureResult result = texture(sphere, scene);
  EXPECT_GT(psnr_from(result.textured, {1.8, 0.8, 0.2}, ball), 34.0);
}

TEST(TextureSurface, LeavesOutWhatOnlyOneViewShows) {
  PaintedScene scene;
  add_ring(scene, 7);
  // A green thing that stands in the middle of the best view only.
  scene.add_view({0.0, 0.05, 1.8}, ground_color);
  scene.images.pictures.back().rgb(cv::Rect(45, 30, 30, 30)).setTo(cv::Scalar(0, 255, 0));
  const TextureResult result = texture(square_mesh(0.6, 16, 0.0), scene);
  EXPECT_GT(result.report.rejected_look_count, 20U);
  EXPECT_GT(psnr_from(result.textured, {0.1, -0.2, 2.0}, ground_color), 36.0);
}

TEST(TextureSurface, LevelsExposures) {
  PaintedScene scene;
  add_ring(scene, 6);
  for (const std::size_t v : {0U, 1U, 5U}) {  // those on one side
    scene.images.pictures[v].rgb *= 0.75;
  }
  TextureOptions options;
  options.seam_cost = 50;
  SerialExecutor executor;
  const auto leveled =
      texture_surface(square_mesh(0.9, 12, 0.0), scene.views, scene.images, options, executor);
  ASSERT_TRUE(leveled.has_value());
  const TextureResult& result = *leveled;
  EXPECT_GT(result.report.seam_step_before, 10.0);
  EXPECT_LT(result.report.seam_step_after_gains, 2.0);
  EXPECT_LT(result.report.seam_step_after, 1.0);
}

TEST(TextureSurface, SplitsATriangleThatTwoViewsSeeInHalves) {
  TriangleMesh mesh;
  mesh.positions = {{-1.5F, -0.4F, 0.0F}, {1.5F, -0.4F, 0.0F}, {0.0F, 0.6F, 0.0F}};
  mesh.faces = {{0, 1, 2}};
  PaintedScene scene;
  for (const double x : {-0.8, 0.8}) {
    scene.add_view({x, 0.1, 2.0}, ground_color);
    scene.views.back().cam_from_world = looking_at({x, 0.1, 2.0}, {x, 0.0, 0.0});
    scene.images.pictures.back().rgb = ray_picture(scene.views.back(), ground_color);
  }
  const TextureResult result = texture(mesh, scene);
  EXPECT_GT(result.report.added_face_count, 10U);
  EXPECT_EQ(result.report.textured_face_count, result.report.face_count);
  EXPECT_GT(psnr_from(result.textured, {0.0, -0.2, 2.5}, ground_color), 42.0);
}

TEST(TextureSurface, UnseenFacesContinueTheColoursAroundThem) {
  TriangleMesh mesh = square_mesh(0.6, 8, 0.0);
  PaintedScene scene;
  const RayColor even = [](const Eigen::Vector3d&, const Eigen::Vector3d&) {
    return Eigen::Vector3d(200.0, 150.0, 100.0);
  };
  scene.add_view({0.0, 0.1, 2.0}, even);
  scene.images.pictures[0].mask = cv::Mat(90, 120, CV_8UC1, cv::Scalar(255));
  scene.images.pictures[0].mask(cv::Rect(45, 30, 30, 30)).setTo(0);
  const TextureResult result = texture(mesh, scene);
  EXPECT_LT(result.report.textured_face_count, result.report.face_count);
  EXPECT_GT(result.report.textured_face_count, 0U);
  EXPECT_GT(psnr_from(result.textured, {0.2, 0.1, 2.0}, even), 45.0);
}

TEST(TextureSurface, FarFromAnyPictureVertexColoursCount) {
  TriangleMesh mesh = square_mesh(0.5, 2, 0.0);
  mesh.colors.assign(mesh.positions.size(), {10, 60, 220});
  PaintedScene scene;
  scene.add_view({0.0, 0.1, -2.0}, ground_color);  // sees the back only
  const TextureResult result = texture(mesh, scene);
  EXPECT_EQ(result.report.textured_face_count, 0U);
  EXPECT_EQ(result.report.chart_count, 0U);
  const RayColor own = [](const Eigen::Vector3d&, const Eigen::Vector3d&) {
    return Eigen::Vector3d(10.0, 60.0, 220.0);
  };
  EXPECT_GT(psnr_from(result.textured, {0.0, 0.1, 2.0}, own), 50.0);
}

TEST(TextureSurface, DoesNotDependOnTheOrderOfWork) {
  const TriangleMesh mesh = square_mesh(0.6, 10, 0.0);
  PaintedScene scene;
  add_ring(scene, 5);
  SerialExecutor forwards;
  ReverseExecutor backwards;
  const auto a = texture_surface(mesh, scene.views, scene.images, {}, forwards);
  const auto b = texture_surface(mesh, scene.views, scene.images, {}, backwards);
  ASSERT_TRUE(a.has_value() && b.has_value());
  EXPECT_EQ(a->textured.face_uv, b->textured.face_uv);
  EXPECT_EQ(a->textured.face_page, b->textured.face_page);
  ASSERT_EQ(a->textured.pages.size(), b->textured.pages.size());
  EXPECT_EQ(cv::norm(a->textured.pages[0], b->textured.pages[0], cv::NORM_INF), 0.0);
}

TEST(TextureSurface, RefusesWhatItCannotUse) {
  PaintedScene scene;
  add_ring(scene, 2);
  SerialExecutor executor;
  const auto code = [&](const TriangleMesh& mesh, const TextureOptions& options) {
    const auto result = texture_surface(mesh, scene.views, scene.images, options, executor);
    return result ? std::optional<ErrorCode>() : std::optional(result.error().code);
  };
  EXPECT_EQ(code({}, {}), ErrorCode::kInsufficientData);
  TriangleMesh broken = square_mesh(0.5, 1, 0.0);
  broken.faces[0][1] = 99;
  EXPECT_EQ(code(broken, {}), ErrorCode::kInvalidArgument);
  TextureOptions options;
  options.seam_cost = -1;
  EXPECT_EQ(code(square_mesh(0.5, 1, 0.0), options), ErrorCode::kInvalidArgument);
  options = {};
  options.atlas.page_size_px = 1000;
  EXPECT_EQ(code(square_mesh(0.5, 1, 0.0), options), ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
