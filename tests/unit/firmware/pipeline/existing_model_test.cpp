#include "firmware/pipeline/existing_model.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/pipeline/model_writer.hpp"
#include "tests/support/synthetic_scene.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

class OpenExistingModel : public ::testing::Test {
 protected:
  void SetUp() override {
    scenes_.assign(2, test_support::make_synthetic_scene({}).truth);
    std::vector<ImageOutcome> images;
    for (const View& view : scenes_[0].views) {
      images.emplace_back().name = view.name;
    }
    images.emplace_back().name = "dark.jpg";
    images.back().reason = RefusalReason::kTooFewFeatures;
    ReportInput input;
    input.components = scenes_;
    input.images = images;
    ASSERT_TRUE(write_model(place_, scenes_, build_report(input)));
  }

  std::vector<Scene> scenes_;
  const test_support::TemporaryFolder folder_;
  const std::filesystem::path output_ = folder_.path();
  ModelFolder place_{output_};
};

TEST_F(OpenExistingModel, BringsAllPartsAndWhatWasRefused) {
  for (const auto& path : {output_, output_ / "model"}) {
    const auto model = open_existing_model(path);
    ASSERT_TRUE(model) << model.error().message;
    EXPECT_EQ(model->components.size(), 2U);
    EXPECT_EQ(model->warning, "");
    ASSERT_EQ(model->history.images.size(), scenes_[0].views.size() + 1);
    EXPECT_EQ(model->history.images.back().reason, RefusalReason::kTooFewFeatures);
  }
}

TEST_F(OpenExistingModel, WarnsWhenTheReportIsDamagedOrOfAnotherModel) {
  std::ofstream(output_ / "model/report.json") << "{";
  const auto damaged = open_existing_model(output_);
  ASSERT_TRUE(damaged);
  EXPECT_THAT(damaged->warning, HasSubstr("not taken over"));
  EXPECT_EQ(damaged->history.images.size(), scenes_[0].views.size());

  std::vector<ImageOutcome> elsewhere(1);
  elsewhere[0].name = "elsewhere.jpg";
  ReportInput input;
  input.images = elsewhere;
  ASSERT_TRUE(write_model(place_, scenes_, build_report(input)));
  const auto foreign = open_existing_model(output_);
  ASSERT_TRUE(foreign);
  EXPECT_THAT(foreign->warning, HasSubstr("does not know the image"));
}

TEST_F(OpenExistingModel, WarnsWhenTheReportTellsTheScaleOfOtherModels) {
  const std::vector<ScaleSection> scale(3);
  ReportInput input;
  input.scale = scale;
  input.components = scenes_;
  const std::vector<ImageOutcome> images = [&] {
    std::vector<ImageOutcome> all;
    for (const View& view : scenes_[0].views) {
      all.emplace_back().name = view.name;
    }
    return all;
  }();
  input.images = images;
  ASSERT_TRUE(write_model(place_, scenes_, build_report(input)));
  const auto model = open_existing_model(output_);
  ASSERT_TRUE(model);
  EXPECT_THAT(model->warning, HasSubstr("the scale of 3 models, there are 2"));
  EXPECT_TRUE(model->history.scale.empty());
}

TEST_F(OpenExistingModel, TakesAModelWithoutAReport) {
  std::filesystem::remove(output_ / "model/report.json");
  const auto model = open_existing_model(output_ / "model/sparse");
  ASSERT_TRUE(model);
  EXPECT_EQ(model->warning, "");
  EXPECT_EQ(model->history.images.size(), scenes_[0].views.size());
}

}  // namespace
}  // namespace trigmesh
