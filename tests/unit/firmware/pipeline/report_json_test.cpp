#include "firmware/pipeline/report_json.hpp"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

ReconstructionReport small_report() {
  ReconstructionReport report;
  report.software_version = "1.2.3";
  report.images_total = 1;
  report.images.resize(1);
  report.images[0].name = "a.jpg";
  report.images[0].features = 12;
  report.cameras.push_back({.camera = Camera{.model = CameraModel::kBrownConrady,
                                             .width_px = 640,
                                             .height_px = 480,
                                             .fx_px = 500.123456789,
                                             .fy_px = 500.0,
                                             .cx_px = 319.5,
                                             .cy_px = 239.5,
                                             .distortion = {0.1, -0.02, 0.003, -0.0004}},
                            .origin = IntrinsicsOrigin::kPriorRefined});
  report.pairs.push_back({.pair = {ViewId{0}, ViewId{1}},
                          .kind = TwoViewKind::kPlanar,
                          .candidates = 9,
                          .inliers = 8});
  return report;
}

TEST(ReportJson, NamesItsSchemaFirst) {
  const Json json = Json::parse(render_report_json(small_report()));
  EXPECT_EQ(json.begin().key(), "schema");
  EXPECT_EQ(json["schema"], 1);
  EXPECT_EQ(json["software"], "trigmesh 1.2.3");
}

TEST(ReportJson, RoundsNumbers) {
  const Json json = Json::parse(render_report_json(small_report()));
  EXPECT_EQ(json["cameras"][0]["fx_px"].dump(), "500.1235");
}

TEST(ReportJson, NamesDistortionByModel) {
  ReconstructionReport report = small_report();
  EXPECT_EQ(Json::parse(render_report_json(report))["cameras"][0]["distortion"].dump(),
            R"({"k1":0.1,"k2":-0.02,"p1":0.003,"p2":-0.0004})");
  report.cameras[0].camera.model = CameraModel::kKannalaBrandt;
  EXPECT_TRUE(Json::parse(render_report_json(report))["cameras"][0]["distortion"].contains("k4"));
  report.cameras[0].camera.model = CameraModel::kPinhole;
  EXPECT_TRUE(Json::parse(render_report_json(report))["cameras"][0]["distortion"].empty());
}

TEST(ReportJson, TellsKindsAndOriginsInWords) {
  const Json json = Json::parse(render_report_json(small_report()));
  EXPECT_EQ(json["pairs"][0]["kind"], "planar");
  EXPECT_EQ(json["cameras"][0]["origin"], "prior_refined");
  EXPECT_EQ(json["images"][0]["status"], "registered");
  EXPECT_EQ(json["verdict"], "not_ready");
}

TEST(ReportJson, HasNullWhereThereIsNoNumber) {
  ReconstructionReport report = small_report();
  report.overall.rmse_px = std::numeric_limits<double>::quiet_NaN();
  const Json json = Json::parse(render_report_json(report));
  EXPECT_TRUE(json["totals"]["reprojection_rmse_px"].is_null());
  EXPECT_TRUE(json["images"][0]["component"].is_null());
}

TEST(ReportJson, HasNoNegativeZero) {
  ReconstructionReport report = small_report();
  report.cameras[0].camera.distortion = {-1e-12, 0.0, 0.0, 0.0};
  EXPECT_THAT(render_report_json(report), Not(HasSubstr("-0.0,")));
}

TEST(ReportJson, ReplacesBytesThatAreNotUtf8) {
  ReconstructionReport report = small_report();
  report.images[0].name = "a\xff.jpg";
  EXPECT_EQ(Json::parse(render_report_json(report))["images"][0]["name"], "a\xEF\xBF\xBD.jpg");
}

TEST(ReportJson, IsTheSameForTheSameReport) {
  EXPECT_EQ(render_report_json(small_report()), render_report_json(small_report()));
  EXPECT_THAT(render_report_json(small_report()), EndsWith("}\n"));
}

TEST(ReportJson, HasNoMemberForStagesThatDidNotRun) {
  const Json json = Json::parse(render_report_json(small_report()));
  for (const char* section : {"scale", "dense", "moving", "surface", "texture", "finish"}) {
    EXPECT_FALSE(json.contains(section)) << section;
  }
  EXPECT_TRUE(json["metres_per_unit"].is_null());
}

TEST(ReportJson, TellsOfTheScale) {
  ReconstructionReport report = small_report();
  report.scale = {{.outcome = ScaleOutcome::kOk,
                   .metres_per_unit = 0.491234567,
                   .sd_ratio = 0.00123456789,
                   .lengths = {{"marker 3", 0.1, 0.49, 0.001, 0.0005}},
                   .markers = {{3, SquareOutcome::kTooFewViews, 2, 2, 0.0}},
                   .z_is_up = true,
                   .up_sd_deg = 0.12345},
                  {.outcome = ScaleOutcome::kDisagreement, .problem = "they differ"}};
  const Json json = Json::parse(render_report_json(report));
  const Json& metric = json["scale"][0];
  EXPECT_EQ(metric["unit"], "metre");
  EXPECT_EQ(metric["outcome"], "ok");
  EXPECT_EQ(metric["metres_per_mapping_unit"], 0.491235);
  EXPECT_EQ(metric["sd_ratio"], 0.00123457);
  EXPECT_EQ(metric["lengths"][0]["name"], "marker 3");
  EXPECT_EQ(metric["markers"][0]["outcome"], "too_few_views");
  EXPECT_EQ(metric["up"], "card");
  EXPECT_EQ(metric["up_sd_deg"], 0.123);
  EXPECT_EQ(json["scale"][1]["unit"], "arbitrary");
  EXPECT_EQ(json["scale"][1]["outcome"], "disagreement");
  EXPECT_EQ(json["scale"][1]["problem"], "they differ");
  EXPECT_EQ(json["scale"][1]["up"], "none");
}

TEST(ReportJson, TellsOfDenseSurfaceAndTexture) {
  ReconstructionReport report = small_report();
  report.metres_per_unit = 0.25;
  report.dense = DenseSection{.views = 7,
                              .map_width_px = 640,
                              .map_height_px = 480,
                              .filled_ratio = 0.87654,
                              .points = 12345,
                              .mean_view_count = 4.5,
                              .lowered = {"half the depth-map size, to keep 700 MB"}};
  report.surface = SurfaceSection{.vertices = 100,
                                  .faces = 196,
                                  .components = 1,
                                  .area = 12.3456789,
                                  .seen_ratio = 0.98,
                                  .holes_filled = 3,
                                  .holes_open = 1,
                                  .largest_holes = {{{1.0, -2.0, 1e-7}, 0.00123456789}}};
  report.texture = TextureSection{.views_used = 6,
                                  .charts = 20,
                                  .pages = 2,
                                  .page_size_px = 4096,
                                  .textured_ratio = 0.95,
                                  .held_out_views = 2,
                                  .psnr_db = 24.567};
  const Json json = Json::parse(render_report_json(report));
  EXPECT_EQ(json["metres_per_unit"], 0.25);
  EXPECT_EQ(json["dense"]["filled_ratio"], 0.877);
  EXPECT_EQ(json["dense"]["lowered"][0], "half the depth-map size, to keep 700 MB");
  EXPECT_EQ(json["surface"]["area"], 12.3457);
  EXPECT_EQ(json["surface"]["largest_holes"][0]["center"][2].dump(), "1e-07");
  EXPECT_EQ(json["surface"]["largest_holes"][0]["perimeter"], 0.00123457);
  EXPECT_EQ(json["texture"]["psnr_db"], 24.57);
  EXPECT_TRUE(json["texture"]["ssim"].is_null());
}

TEST(ReportJson, TellsWhatIsMissing) {
  ReconstructionReport report = small_report();
  report.finish = FinishSection{false,
                                "Not ready.",
                                0.0456789,
                                {{GapKind::kWeak, {1, 2, 3}, 0.03, "a.jpg", -40.04, 12, "go"}}};
  const Json finish = Json::parse(render_report_json(report))["finish"];
  EXPECT_EQ(finish["ready"], false);
  EXPECT_EQ(finish["sentence"], "Not ready.");
  EXPECT_EQ(finish["gap_ratio"], 0.0457);
  EXPECT_EQ(finish["gaps"][0]["kind"], "weak");
  EXPECT_EQ(finish["gaps"][0]["center"][1], 2.0);
  EXPECT_EQ(finish["gaps"][0]["photograph"], "a.jpg");
  EXPECT_EQ(finish["gaps"][0]["turn_left_deg"], -40.0);
  EXPECT_EQ(finish["gaps"][0]["advice"], "go");
}

TEST(ReportJson, TellsWhereSomethingMoved) {
  ReconstructionReport report = small_report();
  report.moving = MovingSection{.images = {{"a.jpg", 0.12345}}, .masked_ratio = 0.0618};
  const Json json = Json::parse(render_report_json(report));
  EXPECT_EQ(json["moving"]["images"][0]["name"], "a.jpg");
  EXPECT_EQ(json["moving"]["images"][0]["masked_ratio"], 0.123);
  EXPECT_EQ(json["moving"]["masked_ratio"], 0.062);
}

TEST(ReportJson, HoldsEmptyListsForAnEmptyReport) {
  const Json json = Json::parse(render_report_json(ReconstructionReport{}));
  for (const char* list : {"notes", "components", "cameras", "images", "pairs", "settings"}) {
    EXPECT_TRUE(json[list].is_array() && json[list].empty()) << list;
  }
}

}  // namespace
}  // namespace trigmesh
