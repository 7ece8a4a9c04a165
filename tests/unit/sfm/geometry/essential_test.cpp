#include "sfm/geometry/essential.hpp"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "sfm/geometry/epipolar.hpp"
#include "sfm/geometry/five_point.hpp"
#include "tests/unit/sfm/geometry/two_view.hpp"

namespace trigmesh {
namespace {

using synthetic::make_two_view;
using synthetic::Random;
using synthetic::Structure;
using synthetic::TwoViewMatches;

double pose_distance(const Rigid3& a, const Rigid3& b) {
  return synthetic::rotation_distance_rad(a.rotation, b.rotation) +
         synthetic::direction_distance_rad(a.translation, b.translation);
}

TEST(DecomposeEssential, AllFourGiveTheMatrixBackAndOneIsTrue) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const TwoViewMatches m = make_two_view(random, {.count = 1});
    const Eigen::Matrix3d e = essential_from_pose(m.second_from_first) * (i % 2 == 0 ? 1.0 : -3.0);
    double nearest = 1e9;
    for (const Rigid3& pose : decompose_essential(e)) {
      const Eigen::Matrix3d again = essential_from_pose(pose) * e.norm() / std::sqrt(2.0);
      EXPECT_NEAR(std::min((again - e).norm(), (again + e).norm()), 0.0, 1e-12);
      EXPECT_NEAR(pose.rotation.norm(), 1.0, 1e-14);
      nearest = std::min(nearest, pose_distance(pose, m.second_from_first));
    }
    EXPECT_LT(nearest, 1e-7);
  }
}

TEST(TwoViewDepths, AreTheDepthsOfTheExactPoint) {
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const Rigid3 pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.2, random.in_box(1.0).normalized())),
                      random.in_box(1.0)};
    const Eigen::Vector3d point = Eigen::Vector3d(0.0, 0.0, 5.0) + random.in_box(2.0);
    const Eigen::Vector3d moved = pose * point;
    const TwoViewDepths depths = two_view_depths(pose, point.hnormalized(), moved.hnormalized());
    EXPECT_NEAR(depths.first, point.z(), 1e-8);
    EXPECT_NEAR(depths.second, moved.z(), 1e-8);
  }
}

TEST(TwoViewDepths, ParallelRaysTellNothing) {
  const TwoViewDepths depths =
      two_view_depths({Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}}, {0.1, 0.2}, {0.1, 0.2});
  EXPECT_EQ(depths.angle_rad, 0.0);
  EXPECT_EQ(depths.first, 0.0);
}

TEST(ChoosePose, TakesTheTrueOne) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const TwoViewMatches m = make_two_view(random, {.count = 30, .noise_px = 0.3});
    const PoseChoice choice =
        choose_pose(essential_from_pose(m.second_from_first), m.first, m.second, {}, {});
    ASSERT_EQ(choice.outcome, CheiralityOutcome::kOk);
    EXPECT_LT(pose_distance(choice.second_from_first, m.second_from_first), 1e-7);
    EXPECT_GT(choice.in_front, 2 * choice.runner_up);
  }
}

TEST(ChoosePose, OneMatchIsEnoughWhenItIsExact) {
  Random random(4);
  const TwoViewMatches m = make_two_view(random, {.count = 1});
  const PoseChoice choice =
      choose_pose(essential_from_pose(m.second_from_first), m.first, m.second, {}, {});
  ASSERT_EQ(choice.outcome, CheiralityOutcome::kOk);
  EXPECT_EQ(choice.in_front, 1U);
  EXPECT_LT(pose_distance(choice.second_from_first, m.second_from_first), 1e-7);
}

TEST(ChoosePose, MaskDecidesWhoIsAsked) {
  Random random(5);
  TwoViewMatches m = make_two_view(random, {.count = 40});
  std::vector<std::uint8_t> mask(40, 1);
  for (std::size_t i = 0; i < 25; ++i) {  // swapped images: these ask for the inverse motion
    std::swap(m.first[i], m.second[i]);
    mask[i] = 0;
  }
  const PoseChoice choice =
      choose_pose(essential_from_pose(m.second_from_first), m.first, m.second, mask, {});
  ASSERT_EQ(choice.outcome, CheiralityOutcome::kOk);
  EXPECT_EQ(choice.in_front, 15U);
}

TEST(ChoosePose, PointsAtInfinityAreTooFewToTell) {
  Random random(6);
  const TwoViewMatches m = make_two_view(random, {.structure = Structure::kInfinity});
  EXPECT_EQ(
      choose_pose(essential_from_pose(m.second_from_first), m.first, m.second, {}, {}).outcome,
      CheiralityOutcome::kTooFewPoints);
  EXPECT_EQ(choose_pose(essential_from_pose(m.second_from_first), {}, {}, {}, {}).outcome,
            CheiralityOutcome::kTooFewPoints);
}

TEST(ChoosePose, HalfTheMatchesBehindIsATie) {
  // Every second match with both rays as if from behind: -x is the same normalised point, so place
  // them by swapping the motion's sign instead.
  Random random(7);
  const TwoViewMatches m = make_two_view(random, {.count = 20});
  Rigid3 backward = m.second_from_first;
  backward.translation = -backward.translation;
  std::vector<Eigen::Vector2d> first;
  std::vector<Eigen::Vector2d> second;
  for (const Rigid3& pose : {m.second_from_first, backward}) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d point = Eigen::Vector3d(0.0, 0.0, 5.0) + random.in_box(1.0);
      first.push_back(point.hnormalized());
      second.push_back((pose * point).hnormalized());
    }
  }
  const PoseChoice choice =
      choose_pose(essential_from_pose(m.second_from_first), first, second, {}, {});
  EXPECT_EQ(choice.outcome, CheiralityOutcome::kAmbiguous);
  EXPECT_EQ(choice.in_front, choice.runner_up);
}

TEST(FivePoint, TrueMatrixIsAmongTheSolutions) {
  Random random(8);
  std::vector<double> errors;
  for (int i = 0; i < 500; ++i) {
    const auto structure = i % 2 == 0 ? Structure::kVolume : Structure::kPlane;
    const TwoViewMatches m = make_two_view(random, {.count = 5, .structure = structure});
    std::array<Eigen::Vector3d, 5> first;
    std::array<Eigen::Vector3d, 5> second;
    for (std::size_t k = 0; k < 5; ++k) {
      first.at(k) = m.first[k].homogeneous();
      second.at(k) = m.second[k].homogeneous();
    }
    const Eigen::Matrix3d truth = essential_from_pose(m.second_from_first).normalized();
    const FivePointSolutions solutions = solve_five_point(first, second);
    double nearest = 1e9;
    for (std::size_t k = 0; k < solutions.count; ++k) {
      const Eigen::Matrix3d& e = solutions.essentials.at(k);
      nearest = std::min({nearest, (e - truth).norm(), (e + truth).norm()});
      for (std::size_t j = 0; j < 5; ++j) {
        EXPECT_NEAR(second.at(j).dot(e * first.at(j)), 0.0, 1e-10);
      }
    }
    errors.push_back(nearest);
  }
  EXPECT_LT(synthetic::median(errors), 1e-10);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() * 98 / 100], 1e-5);
}

TEST(FivePoint, EqualMatchesDoNotCrash) {
  const std::array<Eigen::Vector3d, 5> same{Eigen::Vector3d::UnitZ(),
                                            Eigen::Vector3d::UnitZ(),
                                            Eigen::Vector3d::UnitZ(),
                                            Eigen::Vector3d::UnitZ(),
                                            Eigen::Vector3d::UnitZ()};
  const FivePointSolutions solutions = solve_five_point(same, same);
  for (std::size_t k = 0; k < solutions.count; ++k) {
    EXPECT_TRUE(solutions.essentials.at(k).allFinite());
  }
}

}  // namespace
}  // namespace trigmesh
