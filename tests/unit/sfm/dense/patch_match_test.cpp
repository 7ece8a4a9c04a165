#include "sfm/dense/patch_match.hpp"

#include <atomic>
#include <cstring>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/sfm/dense/rendered_scene.hpp"

namespace trigmesh {
namespace {

using test::correct_share;
using test::plane;
using test::RenderedView;
using test::sphere;
using test::Surface;

/// Hands indices to two threads.
class TwoWorkers final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    std::atomic<std::size_t> next{0};
    const auto run = [&] {
      for (std::size_t i = next++; i < count; i = next++) {
        work(i);
      }
    };
    std::jthread other(run);
    run();
  }
};

/// Five views of surfaces near the origin from 3 units away; the first is the reference.
std::vector<RenderedView> views_of(const std::vector<Surface>& surfaces) {
  std::vector<RenderedView> views;
  for (const Eigen::Vector3d& center : {Eigen::Vector3d(0.0, 0.0, -3.0),
                                        Eigen::Vector3d(0.6, 0.0, -3.0),
                                        Eigen::Vector3d(-0.6, 0.1, -3.0),
                                        Eigen::Vector3d(0.0, 0.55, -3.0)}) {
    views.push_back(
        test::render(surfaces, test::small_camera(), test::look_at(center, {0.0, 0.0, 0.0})));
  }
  return views;
}

StereoProblem problem_of(const std::vector<RenderedView>& views, std::size_t reference = 0) {
  StereoProblem problem;
  problem.reference = views[reference].image;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (v != reference) {
      problem.sources.push_back(views[v].image);
    }
  }
  problem.min_depth = 1.5F;
  problem.max_depth = 6.0F;
  return problem;
}

PatchMatchOptions quick_options() {
  PatchMatchOptions options;
  options.levels = 2;
  options.coarse_iterations = 4;
  return options;
}

DepthMap estimate(const StereoProblem& problem) {
  SerialExecutor executor;
  Result<DepthMap> map = estimate_depth_map(problem, quick_options(), executor);
  EXPECT_TRUE(map.has_value()) << map.error().message;
  return *map;
}

TEST(PatchMatch, FindsAFrontalPlane) {
  const auto views = views_of({plane({0.0, 0.0, -1.0}, 0.0)});
  EXPECT_GT(correct_share(estimate(problem_of(views)), views[0].truth, 0.01), 0.95);
}

TEST(PatchMatch, FindsASlantedPlaneWithItsNormal) {
  const auto views = views_of({plane(Eigen::Vector3d(0.7, 0.2, -1.0).normalized(), 0.0)});
  const DepthMap map = estimate(problem_of(views));
  EXPECT_GT(correct_share(map, views[0].truth, 0.01), 0.95);
  const auto& found = map.normal.at<cv::Vec3f>(36, 48);
  const auto& truth = views[0].truth.normal.at<cv::Vec3f>(36, 48);
  EXPECT_GT(found.dot(truth), 0.97F);
}

TEST(PatchMatch, FindsASphereInFrontOfAWall) {
  const auto views = views_of({plane({0.0, 0.0, -1.0}, -0.8), sphere({0.0, 0.0, 0.0}, 0.6)});
  EXPECT_GT(correct_share(estimate(problem_of(views)), views[0].truth, 0.015), 0.85);
}

TEST(PatchMatch, KeepsAnOccludingDiscApartFromTheWall) {
  const auto views = views_of(
      {plane({0.0, 0.0, -1.0}, -0.5), plane({0.0, 0.0, -1.0}, 0.6, {0.0, 0.0, -0.6}, 0.4)});
  EXPECT_GT(correct_share(estimate(problem_of(views)), views[0].truth, 0.015), 0.85);
}

TEST(PatchMatch, SeedsSaveTheSearch) {
  const auto views = views_of({plane(Eigen::Vector3d(-0.4, 0.3, -1.0).normalized(), 0.0)});
  StereoProblem problem = problem_of(views);
  for (int y = 0; y < 72; y += 8) {
    for (int x = 0; x < 96; x += 8) {
      const float z = views[0].truth.depth.at<float>(y, x);
      problem.seeds_in_cam.emplace_back((static_cast<float>(x) - 47.0F) / 100.0F * z,
                                        (static_cast<float>(y) - 36.5F) / 101.0F * z,
                                        z);
    }
  }
  PatchMatchOptions options = quick_options();
  options.levels = 1;
  options.coarse_iterations = 1;
  SerialExecutor executor;
  const Result<DepthMap> map = estimate_depth_map(problem, options, executor);
  ASSERT_TRUE(map.has_value());
  EXPECT_GT(correct_share(*map, views[0].truth, 0.01), 0.9);
}

TEST(PatchMatch, GeometricRoundTakesHalfSizeMapsAndImprovesThem) {
  const auto views = views_of({plane({0.0, 0.0, -1.0}, -0.8), sphere({0.0, 0.0, 0.0}, 0.6)});
  StereoProblem problem = problem_of(views);
  for (std::size_t v = 1; v < views.size(); ++v) {
    problem.source_maps.push_back(views[v].truth);
  }
  problem.initial = estimate(problem_of(views));
  const double before = correct_share(problem.initial, views[0].truth, 0.01);
  EXPECT_GE(correct_share(estimate(problem), views[0].truth, 0.01), before - 0.005);
}

TEST(PatchMatch, LeavesMaskedPixelsOut) {
  const auto views = views_of({plane({0.0, 0.0, -1.0}, 0.0)});
  StereoProblem problem = problem_of(views);
  problem.reference.mask = cv::Mat(72, 96, CV_8UC1, cv::Scalar(255));
  problem.reference.mask.at<std::uint8_t>(30, 40) = 0;
  const DepthMap map = estimate(problem);
  EXPECT_EQ(map.depth.at<float>(30, 40), 0.0F);
  EXPECT_EQ(map.confidence.at<std::uint8_t>(30, 40), 0);
  EXPECT_GT(map.depth.at<float>(30, 41), 0.0F);
}

TEST(PatchMatch, OneAndTwoWorkersGiveTheSameBytes) {
  const auto views = views_of({sphere({0.0, 0.0, 0.0}, 0.8)});
  const StereoProblem problem = problem_of(views);
  SerialExecutor one;
  TwoWorkers two;
  const Result<DepthMap> a = estimate_depth_map(problem, quick_options(), one);
  const Result<DepthMap> b = estimate_depth_map(problem, quick_options(), two);
  ASSERT_TRUE(a.has_value() && b.has_value());
  const std::size_t pixels = 96 * 72;
  EXPECT_EQ(std::memcmp(a->depth.data, b->depth.data, pixels * 4), 0);
  EXPECT_EQ(std::memcmp(a->normal.data, b->normal.data, pixels * 12), 0);
  EXPECT_EQ(std::memcmp(a->confidence.data, b->confidence.data, pixels), 0);
}

TEST(PatchMatch, RefusesProblemsThatDoNotFit) {
  const auto views = views_of({plane({0.0, 0.0, -1.0}, 0.0)});
  SerialExecutor executor;
  StereoProblem none = problem_of(views);
  none.sources.clear();
  EXPECT_EQ(estimate_depth_map(none, {}, executor).error().code, ErrorCode::kInvalidArgument);
  StereoProblem range = problem_of(views);
  range.max_depth = range.min_depth;
  EXPECT_EQ(estimate_depth_map(range, {}, executor).error().code, ErrorCode::kInvalidArgument);
  StereoProblem size = problem_of(views);
  size.sources[1].camera.width_px = 95;
  EXPECT_EQ(estimate_depth_map(size, {}, executor).error().code, ErrorCode::kInvalidArgument);
  PatchMatchOptions options;
  options.levels = 0;
  EXPECT_EQ(estimate_depth_map(problem_of(views), options, executor).error().code,
            ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
