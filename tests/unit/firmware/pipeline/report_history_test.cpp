#include "firmware/pipeline/report_history.hpp"

#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "firmware/pipeline/report_json.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

ReconstructionReport some_report() {
  ReconstructionReport report;
  report.input_description = "folder fountain, 3 photographs";
  report.images.resize(3);
  report.images[0].name = "a.jpg";
  report.images[1].name = "b.jpg";
  report.images[1].features = 34;
  report.images[2].name = "c.jpg";
  report.images[2].reason = RefusalReason::kTooFewMapMatches;
  report.images[2].detail = "3 of 9";
  report.images[2].map_matches = 9;
  report.images[2].map_inliers = 3;
  report.pairs = {{{ViewId{0}, ViewId{1}}, TwoViewKind::kPlanar, 20, 15},
                  {{ViewId{1}, ViewId{2}}, TwoViewKind::kNone, 4, 0}};
  report.frames = {{"a.jpg", 0.0, FrameVerdict::kKept, {}},
                   {"ab.jpg", 0.25, FrameVerdict::kTooLittleMotion, {.motion_deg = 0.5}}};
  report.cameras.resize(1);
  report.cameras[0].group = 1;
  report.cameras[0].origin = IntrinsicsOrigin::kPriorRefined;
  report.settings = {{"seed", "7"}};
  report.finish = FinishSection{
      true, "Ready.", 0.01, {{GapKind::kHole, {1, -2, 3}, 0.01, "b.jpg", 40, -10, "go left"}}};
  report.scale = {
      {.outcome = ScaleOutcome::kOk,
       .metres_per_unit = 0.49,
       .sd_ratio = 0.0012,
       .lengths = {{"marker 3", 0.1, 0.4901, 0.001, 0.0005}},
       .markers = {{3, SquareOutcome::kOk, 9, 8, 0.25}, {5, SquareOutcome::kSmallAngle, 4, 4, 0.0}},
       .z_is_up = true,
       .up_sd_deg = 0.125},
      {.outcome = ScaleOutcome::kNothingMeasured, .problem = "no marker", .up_problem = "askew"}};
  return report;
}

TEST(ReportHistory, IsWhatTheReportWasMadeFrom) {
  const auto history = parse_report_history(render_report_json(some_report()));
  ASSERT_TRUE(history) << history.error().message;
  EXPECT_EQ(history->input_description, "folder fountain, 3 photographs");
  ASSERT_EQ(history->images.size(), 3U);
  EXPECT_EQ(history->images[1].features, 34U);
  EXPECT_EQ(history->images[2].reason, RefusalReason::kTooFewMapMatches);
  EXPECT_EQ(history->images[2].detail, "3 of 9");
  EXPECT_EQ(history->images[2].map_matches, 9U);
  EXPECT_EQ(history->images[2].map_inliers, 3U);
  ASSERT_EQ(history->pairs.size(), 2U);
  EXPECT_EQ(history->pairs[0].kind, TwoViewKind::kPlanar);
  EXPECT_EQ(history->pairs[0].candidates, 20U);
  EXPECT_EQ(history->pairs[1].pair.second, ViewId{2});
  ASSERT_EQ(history->frames.size(), 2U);
  EXPECT_EQ(history->frames[1].name, "ab.jpg");
  EXPECT_EQ(history->frames[1].time_s, 0.25);
  EXPECT_EQ(history->frames[1].verdict, FrameVerdict::kTooLittleMotion);
  EXPECT_EQ(history->frames[1].measures.motion_deg, 0.5);
  EXPECT_EQ(history->intrinsics_origins,
            (std::vector{IntrinsicsOrigin::kSolved, IntrinsicsOrigin::kPriorRefined}));
  ASSERT_EQ(history->settings.size(), 1U);
  EXPECT_EQ(history->settings[0].value, "7");
}

TEST(ReportHistory, KnowsWhatWasMissing) {
  const auto history = parse_report_history(render_report_json(some_report()));
  ASSERT_TRUE(history) << history.error().message;
  ASSERT_TRUE(history->finish.has_value());
  EXPECT_TRUE(history->finish->ready);
  EXPECT_EQ(history->finish->sentence, "Ready.");
  EXPECT_EQ(history->finish->gap_ratio, 0.01);
  ASSERT_EQ(history->finish->gaps.size(), 1U);
  const FinishGap& gap = history->finish->gaps[0];
  EXPECT_EQ(gap.kind, GapKind::kHole);
  EXPECT_EQ(gap.center_in_world, Eigen::Vector3d(1, -2, 3));
  EXPECT_EQ(gap.photograph, "b.jpg");
  EXPECT_EQ(gap.turn_left_deg, 40.0);
  EXPECT_EQ(gap.rise_deg, -10.0);
  EXPECT_EQ(gap.advice, "go left");
}

TEST(ReportHistory, MayHaveNoFinish) {
  Json document = Json::parse(render_report_json(some_report()));
  document.erase("finish");
  const auto history = parse_report_history(document.dump());
  ASSERT_TRUE(history) << history.error().message;
  EXPECT_FALSE(history->finish.has_value());
}

TEST(ReportHistory, KnowsTheScale) {
  const auto history = parse_report_history(render_report_json(some_report()));
  ASSERT_TRUE(history) << history.error().message;
  ASSERT_EQ(history->scale.size(), 2U);
  const ScaleSection& metric = history->scale[0];
  EXPECT_EQ(metric.outcome, ScaleOutcome::kOk);
  EXPECT_EQ(metric.metres_per_unit, 0.49);
  EXPECT_EQ(metric.sd_ratio, 0.0012);
  ASSERT_EQ(metric.lengths.size(), 1U);
  EXPECT_EQ(metric.lengths[0].name, "marker 3");
  EXPECT_EQ(metric.lengths[0].known_m, 0.1);
  EXPECT_EQ(metric.lengths[0].metres_per_unit, 0.4901);
  EXPECT_EQ(metric.lengths[0].sd_ratio, 0.001);
  EXPECT_EQ(metric.lengths[0].edge_sd_ratio, 0.0005);
  ASSERT_EQ(metric.markers.size(), 2U);
  EXPECT_EQ(metric.markers[0].id, 3);
  EXPECT_EQ(metric.markers[0].views_seen, 9U);
  EXPECT_EQ(metric.markers[0].views_used, 8U);
  EXPECT_EQ(metric.markers[0].rms_px, 0.25);
  EXPECT_EQ(metric.markers[1].outcome, SquareOutcome::kSmallAngle);
  EXPECT_TRUE(metric.z_is_up);
  EXPECT_EQ(metric.up_sd_deg, 0.125);
  EXPECT_EQ(history->scale[1].outcome, ScaleOutcome::kNothingMeasured);
  EXPECT_EQ(history->scale[1].problem, "no marker");
  EXPECT_FALSE(history->scale[1].z_is_up);
  EXPECT_EQ(history->scale[1].up_problem, "askew");
}

TEST(ReportHistory, MayHaveNoScale) {
  Json document = Json::parse(render_report_json(some_report()));
  document.erase("scale");
  const auto history = parse_report_history(document.dump());
  ASSERT_TRUE(history) << history.error().message;
  EXPECT_TRUE(history->scale.empty());
}

TEST(ReportHistory, MayHaveNoFrames) {
  Json document = Json::parse(render_report_json(some_report()));
  document.erase("frames");
  const auto history = parse_report_history(document.dump());
  ASSERT_TRUE(history) << history.error().message;
  EXPECT_TRUE(history->frames.empty());
}

struct Damage {
  const char* name;
  std::function<void(Json&)> apply;
  const char* message;
};

class DamagedReport : public ::testing::TestWithParam<Damage> {};

TEST_P(DamagedReport, IsRefusedWithTheMember) {
  Json document = Json::parse(render_report_json(some_report()));
  GetParam().apply(document);
  const auto history = parse_report_history(document.dump());
  ASSERT_FALSE(history);
  EXPECT_EQ(history.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(history.error().message, HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds,
    DamagedReport,
    ::testing::Values(
        Damage{"NoObject", [](Json& json) { json = 3; }, "not a JSON object"},
        Damage{"OtherSchema", [](Json& json) { json["schema"] = 2; }, "\"schema\""},
        Damage{"NoImages", [](Json& json) { json.erase("images"); }, "\"images\" is no list"},
        Damage{"ImageIsNumber", [](Json& json) { json["images"][0] = 1; }, "\"images\""},
        Damage{"NoName", [](Json& json) { json["images"][0]["name"] = 1; }, "\"name\" is no text"},
        Damage{"UnknownReason",
               [](Json& json) { json["images"][0]["status"] = "bored"; },
               "\"status\""},
        Damage{"NegativeCount", [](Json& json) { json["images"][0]["features"] = -1; }, "features"},
        Damage{"PairOutside", [](Json& json) { json["pairs"][0]["second"] = 3; }, "\"second\""},
        Damage{"PairBackwards", [](Json& json) { json["pairs"][1]["first"] = 2; }, "\"second\""},
        Damage{"UnknownKind", [](Json& json) { json["pairs"][0]["kind"] = ""; }, "\"kind\""},
        Damage{"UnknownVerdict",
               [](Json& json) { json["frames"][0]["verdict"] = "nice"; },
               "\"verdict\""},
        Damage{"NoTime", [](Json& json) { json["frames"][1].erase("time_s"); }, "\"time_s\""},
        Damage{"HugeGroup",
               [](Json& json) { json["cameras"][0]["group"] = 4'000'000'000U; },
               "\"group\""},
        Damage{"FinishIsText", [](Json& json) { json["finish"] = "done"; }, "\"ready\""},
        Damage{"GapInThePlane",
               [](Json& json) {
                 json["finish"]["gaps"][0]["center"] = {1, 2};
               },
               "\"center\" is no point"},
        Damage{"GapOfAnotherKind",
               [](Json& json) { json["finish"]["gaps"][0]["kind"] = "tear"; },
               "\"kind\""},
        Damage{"ScaleIsText", [](Json& json) { json["scale"] = "1:20"; }, "\"scale\" is no list"},
        Damage{"UnknownScaleOutcome",
               [](Json& json) { json["scale"][0]["outcome"] = "fine"; },
               "\"outcome\""},
        Damage{"NoKnownLength",
               [](Json& json) { json["scale"][0]["lengths"][0].erase("known_m"); },
               "\"known_m\" is no number"},
        Damage{"NoMarkers",
               [](Json& json) { json["scale"][1].erase("markers"); },
               "\"markers\" is no list"},
        Damage{"HugeMarker",
               [](Json& json) { json["scale"][0]["markers"][0]["id"] = 1000; },
               "\"id\""},
        Damage{"UnknownUp", [](Json& json) { json["scale"][0]["up"] = "down"; }, "\"up\""},
        Damage{"UnknownOrigin",
               [](Json& json) { json["cameras"][0]["origin"] = "guessed"; },
               "\"origin\""}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace trigmesh
