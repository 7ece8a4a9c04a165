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

TEST(ReportJson, HoldsEmptyListsForAnEmptyReport) {
  const Json json = Json::parse(render_report_json(ReconstructionReport{}));
  for (const char* list : {"notes", "components", "cameras", "images", "pairs", "settings"}) {
    EXPECT_TRUE(json[list].is_array() && json[list].empty()) << list;
  }
}

}  // namespace
}  // namespace trigmesh
