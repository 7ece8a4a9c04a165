#include "firmware/pipeline/surface_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

std::vector<DenseView> views_of(int width_px, int height_px, std::size_t count) {
  DenseView view;
  view.camera = {.width_px = width_px,
                 .height_px = height_px,
                 .fx_px = 1000.0,
                 .fy_px = 1000.0,
                 .cx_px = 0.5 * width_px,
                 .cy_px = 0.5 * height_px};
  return std::vector<DenseView>(count, view);
}

int map_width(std::span<const DenseView> views, const SurfacePlan& plan) {
  return scaled_side(views.front().camera.width_px, plan.map_scale);
}

TEST(PlanSurface, StandardTakesHalfTheSizeButNotLessThan640) {
  const auto large = views_of(1536, 1024, 11);
  EXPECT_EQ(map_width(large, *plan_surface(large, {}, 0)), 768);
  const auto middle = views_of(960, 720, 48);
  EXPECT_EQ(map_width(middle, *plan_surface(middle, {}, 0)), 640);
  const auto small = views_of(320, 240, 5);
  EXPECT_EQ(map_width(small, *plan_surface(small, {}, 0)), 320);
}

TEST(PlanSurface, FineAndAGivenSizeAreBoundedByThePhotographs) {
  const auto views = views_of(1536, 1024, 11);
  EXPECT_EQ(map_width(views, *plan_surface(views, {.preset = QualityPreset::kFine}, 0)), 1536);
  EXPECT_EQ(map_width(views, *plan_surface(views, {.map_side_px = 300}, 0)), 300);
  EXPECT_EQ(map_width(views, *plan_surface(views, {.map_side_px = 5000}, 0)), 1536);
}

TEST(PlanSurface, ALimitThatIsKeptAnywayChangesNothing) {
  const auto views = views_of(1536, 1024, 25);
  const auto free = plan_surface(views, {}, 0);
  const auto bounded = plan_surface(views, {}, 8'000'000'000);
  ASSERT_TRUE(free && bounded);
  EXPECT_EQ(bounded->map_scale, free->map_scale);
  EXPECT_TRUE(bounded->lowered.empty());
}

TEST(PlanSurface, LowersQualityInStepsThatItTells) {
  const auto views = views_of(1536, 1024, 25);
  double last_scale = 1.0;
  for (const std::uint64_t limit : {1'500'000'000U, 700'000'000U, 400'000'000U}) {
    const auto plan = plan_surface(views, {}, limit);
    ASSERT_TRUE(plan) << plan.error().message;
    EXPECT_LE(plan->map_scale, last_scale);
    last_scale = plan->map_scale;
  }
  const auto tight = plan_surface(views, {}, 400'000'000);
  ASSERT_TRUE(tight);
  EXPECT_FALSE(tight->lowered.empty());
  for (const std::string& sentence : tight->lowered) {
    EXPECT_THAT(sentence, testing::HasSubstr("to keep the memory limit"));
  }
}

TEST(PlanSurface, SearchesForWhatMovedInSmallerPicturesOrNotAtAll) {
  const auto views = views_of(960, 720, 100);
  const BuildOptions dense{.last_stage = LastStage::kDense};
  const auto side = [&](std::uint64_t limit) {
    return plan_surface(views, dense, limit)->moving_side_px;
  };
  EXPECT_EQ(side(0), 480);
  EXPECT_EQ(side(1'000'000'000), 480);
  EXPECT_LT(side(600'000'000), 480);
  EXPECT_GE(side(600'000'000), 160);
  EXPECT_EQ(side(260'000'000), 0);
  EXPECT_THAT(plan_surface(views, dense, 260'000'000)->lowered,
              testing::Contains(testing::HasSubstr("things that moved were not looked for")));
  EXPECT_EQ(plan_surface(views, {.moving = MovingUse::kOff}, 0)->moving_side_px, 0);
}

TEST(PlanSurface, SaysWhenNoSettingIsSmallEnough) {
  const auto views = views_of(1536, 1024, 25);
  const auto plan = plan_surface(views, {}, 20'000'000);
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, ErrorCode::kLimitExceeded);
  EXPECT_THAT(plan.error().message, testing::HasSubstr("--memory-limit"));
}

TEST(BuildOptions, NamesComeBackAndValuesAreChecked) {
  for (const LastStage stage :
       {LastStage::kSparse, LastStage::kDense, LastStage::kMesh, LastStage::kTexture}) {
    EXPECT_EQ(last_stage_from_string(to_string(stage)), stage);
  }
  for (const QualityPreset preset :
       {QualityPreset::kPreview, QualityPreset::kStandard, QualityPreset::kFine}) {
    EXPECT_EQ(quality_preset_from_string(to_string(preset)), preset);
  }
  for (const MovingUse use : {MovingUse::kAuto, MovingUse::kOff}) {
    EXPECT_EQ(moving_use_from_string(to_string(use)), use);
  }
  EXPECT_FALSE(last_stage_from_string("poisson"));
  EXPECT_FALSE(BuildOptions{.max_faces = -1}.validate());
  EXPECT_FALSE(BuildOptions{.map_side_px = 10}.validate());
  EXPECT_FALSE(BuildOptions{.texture_size_px = 1000}.validate());
  EXPECT_FALSE((
      BuildOptions{.last_stage = LastStage::kDense, .preset = QualityPreset::kPreview}.validate()));
}

}  // namespace
}  // namespace trigmesh
