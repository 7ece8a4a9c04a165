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
        Damage{"UnknownOrigin",
               [](Json& json) { json["cameras"][0]["origin"] = "guessed"; },
               "\"origin\""}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace trigmesh
