#include "firmware/pipeline/report_html.hpp"

#include <bit>
#include <cstdint>
#include <numeric>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "firmware/pipeline/report_geometry.hpp"
#include "firmware/pipeline/report_json.hpp"
#include "tests/support/synthetic_scene.hpp"

namespace trigmesh {
namespace {

using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::size_t kNoLimit = 1'000'000;

std::size_t count_of(std::string_view text, std::string_view part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string_view::npos;
       at = text.find(part, at + part.size())) {
    ++count;
  }
  return count;
}

/// What stands in the data block with this id.
std::string data_block(const std::string& html, const std::string& id) {
  const std::string opening = R"(<script type="application/json" id=")" + id + "\">";
  const std::size_t start = html.find(opening) + opening.size();
  return html.substr(start, html.find("</script>", start) - start);
}

ReconstructionReport report_of(std::span<const Scene> scenes) {
  std::vector<ImageOutcome> images;
  for (const Scene& scene : scenes) {
    for (const View& view : scene.views) {
      ImageOutcome outcome;
      outcome.name = view.name;
      images.push_back(std::move(outcome));
    }
  }
  ReportInput input;
  input.components = scenes;
  input.images = images;
  return build_report(input);
}

std::vector<Scene> small_model() {
  return {test_support::make_synthetic_scene({.points = 100, .views = 4}).truth};
}

std::vector<std::uint8_t> decode_base64(std::string_view text) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> bytes;
  std::uint32_t bits = 0;
  int available = 0;
  for (const char c : text) {
    if (c == '=') {
      break;
    }
    bits = (bits << 6U) | static_cast<std::uint32_t>(kDigits.find(c));
    available += 6;
    if (available >= 8) {
      available -= 8;
      bytes.push_back(
          static_cast<std::uint8_t>((bits >> static_cast<unsigned>(available)) & 0xFFU));
    }
  }
  return bytes;
}

std::vector<std::uint32_t> decode_leb128(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint32_t> numbers;
  std::uint32_t value = 0;
  unsigned shift = 0;
  for (const std::uint8_t byte : bytes) {
    value |= (byte & 0x7FU) << shift;
    shift += 7;
    if (byte < 0x80U) {
      numbers.push_back(value);
      value = 0;
      shift = 0;
    }
  }
  return numbers;
}

float float_at(const std::vector<std::uint8_t>& bytes, std::size_t position) {
  std::uint32_t bits = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    bits |= static_cast<std::uint32_t>(bytes[4 * position + k]) << (8 * k);
  }
  return std::bit_cast<float>(bits);
}

TEST(ReportHtml, CarriesTheReportUnchanged) {
  const std::vector<Scene> scenes = small_model();
  const ReconstructionReport report = report_of(scenes);
  const Json carried = Json::parse(data_block(render_report_html(report, scenes), "report-data"));
  EXPECT_EQ(carried, Json::parse(render_report_json(report)));
}

TEST(ReportHtml, LetsNoNameBecomeMarkup) {
  const std::string hostile =
      "</script><script>alert(1)</script><!-- <img src=x onerror=\"alert('2')\"> & ]]>.jpg";
  ImageOutcome outcome;
  outcome.name = hostile;
  outcome.detail = hostile;
  outcome.reason = RefusalReason::kUnreadable;
  const std::vector<ImageOutcome> images{outcome};
  ReportInput input;
  input.images = images;
  input.input_description = hostile;
  input.settings = {{hostile, hostile}};
  input.notes = {{NoteSeverity::kError, hostile}};
  const std::string html = render_report_html(build_report(input), {});
  const std::string harmless = render_report_html(ReconstructionReport{}, {});
  for (const char* markup : {"<script", "</script", "<!--", "<img", "]]>"}) {
    EXPECT_EQ(count_of(html, markup), count_of(harmless, markup)) << markup;
  }
  EXPECT_EQ(Json::parse(data_block(html, "report-data"))["images"][0]["name"], hostile);
}

TEST(ReportHtml, AllowsNothingFromTheNetwork) {
  const std::string html = render_report_html(ReconstructionReport{}, {});
  EXPECT_THAT(
      html,
      HasSubstr("Content-Security-Policy\" content=\"default-src 'none'; script-src 'sha256-"));
  EXPECT_THAT(html, Not(HasSubstr("unsafe-inline")));
  EXPECT_THAT(html, Not(HasSubstr("<script src")));
  EXPECT_THAT(html, Not(HasSubstr("<link rel=\"stylesheet")));
}

TEST(ReportHtml, IsTheSameForTheSameInput) {
  const std::vector<Scene> scenes = small_model();
  const ReconstructionReport report = report_of(scenes);
  EXPECT_EQ(render_report_html(report, scenes), render_report_html(report, scenes));
}

TEST(ReportGeometry, KeepsPointsAndColors) {
  const std::vector<Scene> scenes = small_model();
  const Json json = Json::parse(render_report_geometry(report_of(scenes), scenes, kNoLimit));
  const std::vector<std::uint8_t> positions = decode_base64(json["positions"].get<std::string>());
  const std::vector<std::uint8_t> colors = decode_base64(json["colors"].get<std::string>());
  const std::vector<Landmark>& landmarks = scenes[0].landmarks;
  ASSERT_EQ(positions.size(), 12 * landmarks.size());
  ASSERT_EQ(colors.size(), 3 * landmarks.size());
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(
          float_at(positions, 3 * i + axis),
          static_cast<float>(landmarks[i].position_in_world[static_cast<Eigen::Index>(axis)]));
      EXPECT_EQ(colors[3 * i + axis], landmarks[i].color_rgb[axis]);
    }
  }
}

TEST(ReportGeometry, TellsWhichCameraSeesWhichPoint) {
  const std::vector<Scene> scenes = small_model();
  const Json json = Json::parse(render_report_geometry(report_of(scenes), scenes, kNoLimit));
  const std::vector<std::uint32_t> numbers =
      decode_leb128(decode_base64(json["visibility"].get<std::string>()));
  std::size_t at = 0;
  for (std::size_t view = 0; view < scenes[0].views.size(); ++view) {
    std::vector<std::uint32_t> expected;
    for (std::size_t i = 0; i < scenes[0].landmarks.size(); ++i) {
      for (const Observation& observation : scenes[0].landmarks[i].track) {
        if (index(observation.view) == view) {
          expected.push_back(static_cast<std::uint32_t>(i));
        }
      }
    }
    ASSERT_EQ(numbers[at++], expected.size());
    std::uint32_t point = 0;
    for (const std::uint32_t wanted : expected) {
      point += numbers[at++];
      EXPECT_EQ(point, wanted);
    }
  }
  EXPECT_EQ(at, numbers.size());
}

TEST(ReportGeometry, TellsWhereCamerasStand) {
  const std::vector<Scene> scenes = small_model();
  const Json json = Json::parse(render_report_geometry(report_of(scenes), scenes, kNoLimit));
  const Json& poses = json["components"][0]["poses"];
  ASSERT_EQ(poses.size(), scenes[0].views.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Rigid3& cam_from_world = *scenes[0].views[i].cam_from_world;
    const std::vector<double> center = poses[i]["center"];
    const std::vector<double> xyzw = poses[i]["rotation"];
    const Eigen::Vector3d in_cam =
        cam_from_world * Eigen::Vector3d(center[0], center[1], center[2]);
    EXPECT_LT(in_cam.norm(), 1e-9);
    const Eigen::Quaterniond world_from_cam(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
    EXPECT_LT(rotation_angle(world_from_cam * cam_from_world.rotation), 1e-7);
    EXPECT_EQ(poses[i]["camera"], 0);
  }
}

TEST(ReportGeometry, ThinsComponentsAlikeDownToTheLimit) {
  const test_support::SyntheticScene large =
      test_support::make_synthetic_scene({.points = 400, .views = 4});
  std::vector<Scene> scenes{large.truth, small_model()[0]};
  for (View& view : scenes[1].views) {
    view.name = "side/" + view.name;
  }
  const std::size_t limit = 60;
  const Json json = Json::parse(render_report_geometry(report_of(scenes), scenes, limit));
  std::size_t kept = 0;
  std::size_t total = 0;
  for (std::size_t c = 0; c < scenes.size(); ++c) {
    EXPECT_EQ(json["components"][c]["points_total"], scenes[c].landmarks.size());
    kept += json["components"][c]["points"].get<std::size_t>();
    total += scenes[c].landmarks.size();
  }
  EXPECT_LE(kept, limit);
  EXPECT_GE(kept, limit - scenes.size());
  EXPECT_EQ(decode_base64(json["positions"].get<std::string>()).size(), 12 * kept);
  const double share = json["components"][0]["points"].get<double>() /
                       static_cast<double>(scenes[0].landmarks.size());
  EXPECT_NEAR(share, static_cast<double>(limit) / static_cast<double>(total), 0.02);
}

TEST(ReportGeometry, IsEmptyWithoutComponents) {
  const Json json = Json::parse(render_report_geometry(ReconstructionReport{}, {}, kNoLimit));
  EXPECT_TRUE(json["components"].empty());
  EXPECT_EQ(json["positions"], "");
}

DepthPicture depth_picture_of(const std::string& image_name) {
  return {.image_name = image_name,
          .image_jpeg = {1, 2, 3},
          .depth_jpeg = {4, 5},
          .confidence_jpeg = {6},
          .near_depth = 1.5,
          .far_depth = 4.0,
          .filled_ratio = 0.5};
}

TEST(ReportHtml, CarriesTheMeshInBase64) {
  const std::vector<Scene> scenes = small_model();
  ReportAttachments attachments;
  const std::string glb("glTF\0\xFF<&", 8);
  attachments.glb = glb;
  const Json model = Json::parse(
      data_block(render_report_html(report_of(scenes), scenes, attachments), "model-data"));
  const std::vector<std::uint8_t> bytes = decode_base64(model["glb"].get<std::string>());
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), glb);
  EXPECT_EQ(model["name"], "textured.glb");
  EXPECT_EQ(model["bytes"], 8);
}

TEST(ReportHtml, NamesAMeshThatIsTooLarge) {
  const std::string at_limit(kReportPageGlbLimitBytes, 'x');
  const std::string above(kReportPageGlbLimitBytes + 1, 'x');
  ReportAttachments attachments;
  attachments.glb = at_limit;
  const std::string with = render_report_html({}, {}, attachments);
  EXPECT_EQ(data_block(with, "model-data").find("\"glb\":null"), std::string::npos);
  attachments.glb = above;
  const std::string without = render_report_html({}, {}, attachments);
  EXPECT_TRUE(Json::parse(data_block(without, "model-data"))["glb"].is_null());
  EXPECT_LT(without.size(), std::size_t{4} << 20);
}

TEST(ReportHtml, HasNoBlocksWithoutAttachments) {
  const std::string html = render_report_html({}, {});
  EXPECT_THAT(html, Not(HasSubstr("id=\"model-data\"")));
  EXPECT_THAT(html, Not(HasSubstr("id=\"depth-data\"")));
}

TEST(ReportHtml, CarriesDepthPicturesOfKnownImages) {
  const std::vector<Scene> scenes = small_model();
  const std::vector<DepthPicture> pictures{depth_picture_of(scenes[0].views[2].name),
                                           depth_picture_of("unknown.jpg")};
  ReportAttachments attachments;
  attachments.depth_pictures = pictures;
  const Json list = Json::parse(
      data_block(render_report_html(report_of(scenes), scenes, attachments), "depth-data"));
  ASSERT_EQ(list.size(), 1U);
  EXPECT_EQ(list[0]["image"], 2);
  EXPECT_EQ(decode_base64(list[0]["picture"].get<std::string>()), pictures[0].image_jpeg);
  EXPECT_EQ(list[0]["near"], 1.5);
}

TEST(ReportHtml, LimitsTheNumberOfDepthPictures) {
  const std::vector<Scene> scenes = small_model();
  const std::vector<DepthPicture> pictures(kReportDepthViewLimit + 5,
                                           depth_picture_of(scenes[0].views[0].name));
  ReportAttachments attachments;
  attachments.depth_pictures = pictures;
  const Json list = Json::parse(
      data_block(render_report_html(report_of(scenes), scenes, attachments), "depth-data"));
  EXPECT_EQ(list.size(), kReportDepthViewLimit);
}

}  // namespace
}  // namespace trigmesh
