#include "firmware/pipeline/report_scale.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

ScaleSection metric_section() {
  return {.outcome = ScaleOutcome::kOk, .metres_per_unit = 0.4, .sd_ratio = 0.00123};
}

TEST(ReportScale, SaysThatNothingWasKnown) {
  EXPECT_FALSE(is_metric({}));
  EXPECT_THAT(units_sentence({}), StartsWith("Up to scale"));
  EXPECT_THAT(units_sentence({}), HasSubstr("no metric reference was given"));
  EXPECT_TRUE(scale_notes({}).empty());
}

TEST(ReportScale, SaysThatLengthsAreMetresAndHowExactly) {
  std::vector<ScaleSection> scale{metric_section()};
  EXPECT_TRUE(is_metric(scale));
  EXPECT_EQ(units_sentence(scale),
            "Metric: lengths are in metres with a standard deviation of 0.12 %; the axes are those "
            "that mapping chose.");
  scale[0].z_is_up = true;
  scale[0].up_sd_deg = 0.256;
  EXPECT_THAT(units_sentence(scale), HasSubstr("z is up, off the card (standard deviation 0.26"));
  EXPECT_TRUE(scale_notes(scale).empty());
}

TEST(ReportScale, ADisagreementIsAnError) {
  const std::vector<ScaleSection> scale{
      {.outcome = ScaleOutcome::kDisagreement, .problem = "they differ"}};
  EXPECT_FALSE(is_metric(scale));
  EXPECT_THAT(units_sentence(scale), HasSubstr("because known lengths contradict each other."));
  const std::vector<ReportNote> notes = scale_notes(scale);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_EQ(notes[0].severity, NoteSeverity::kError);
  EXPECT_EQ(notes[0].text, "the model has no scale: they differ");
}

TEST(ReportScale, WarnsOfEachModelWithoutScaleOrUp) {
  std::vector<ScaleSection> scale{metric_section(), {.problem = "no marker"}};
  scale[0].up_problem = "askew";
  EXPECT_TRUE(is_metric(scale));
  const std::vector<ReportNote> notes = scale_notes(scale);
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_EQ(notes[0].severity, NoteSeverity::kWarning);
  EXPECT_THAT(units_sentence({scale.data() + 1, 1}), HasSubstr("no known length could be"));
  EXPECT_EQ(notes[0].text, "model 1 has no known up: askew");
  EXPECT_EQ(notes[1].text, "model 2 has no scale: no marker");
}

}  // namespace
}  // namespace trigmesh
