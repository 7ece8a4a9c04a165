// Opens report pages in a real browser without a window, from a file, with the network cut off, and
// looks at what the page made of itself. Skipped, saying so, where Chromium is not installed
// (apt-get install chromium).

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/pipeline/report_html.hpp"
#include "tests/integration/sample_report.hpp"
#include "tests/support/synthetic_scene.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kBrowser = "/usr/bin/chromium";

std::size_t count_of(std::string_view text, std::string_view part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string_view::npos;
       at = text.find(part, at + part.size())) {
    ++count;
  }
  return count;
}

std::string read_text(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// What the browser made of a page.
struct Visit {
  std::string dom;  ///< the document after the page's script ran
  std::string log;  ///< the browser's log with the page's console
};

class ReportPage : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kBrowser)) {
      GTEST_SKIP() << kBrowser
                   << " is not installed (apt-get install chromium): the page was not looked at";
    }
  }

  /// Opens the page with `fragment` behind its address ("#check").
  Visit open(const std::string& html, const std::string& fragment) {
    std::ofstream(folder_ / "report.html") << html;
    const std::string command =
        std::string(kBrowser) +
        " --headless --no-sandbox --disable-gpu --disable-quic --no-first-run"
        " --disable-background-networking --disable-component-update --disable-sync"
        " --disable-dev-shm-usage --use-angle=swiftshader --enable-unsafe-swiftshader"
        " --host-resolver-rules='MAP * ~NOTFOUND' --window-size=1280,900"
        " --enable-logging=stderr --virtual-time-budget=3000 --user-data-dir='" +
        (folder_ / "profile").string() + "' --dump-dom 'file://" +
        (folder_ / "report.html").string() + fragment + "' > '" + (folder_ / "dom").string() +
        "' 2> '" + (folder_ / "log").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << read_text(folder_ / "log");
    return {.dom = read_text(folder_ / "dom"), .log = read_text(folder_ / "log")};
  }

  static void expect_sound(const Visit& visit) {
    EXPECT_THAT(visit.dom, HasSubstr("data-ready=\"true\""));
    EXPECT_THAT(visit.dom, HasSubstr("data-problems=\"0\""));
    EXPECT_THAT(visit.dom, HasSubstr("data-requests=\"0\""));
    EXPECT_THAT(visit.log, Not(HasSubstr("Uncaught")));
    EXPECT_THAT(visit.log, Not(HasSubstr("Refused to")));
    EXPECT_THAT(visit.log, Not(HasSubstr("ERR_")));
  }

  /// Pixels of the 3D view that are not empty, as the page counted them.
  static long drawn_pixels(const Visit& visit) {
    constexpr std::string_view kMark = "data-drawn=\"";
    const std::size_t at = visit.dom.find(kMark);
    return at == std::string::npos
               ? -1
               : std::strtol(visit.dom.c_str() + at + kMark.size(), nullptr, 10);
  }

 private:
  const test_support::TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

ImageOutcome outcome_named(std::string name) {
  ImageOutcome outcome;
  outcome.name = std::move(name);
  return outcome;
}

/// A page of `scene` with one more image, refused, of a name that would love to be markup.
std::string page_of(const test_support::SyntheticScene& scene) {
  std::vector<ImageOutcome> images;
  for (const View& view : scene.truth.views) {
    images.push_back(outcome_named(view.name));
  }
  images.push_back(outcome_named(
      "</script><script>document.body.dataset.hacked = 1</script><b id=\"hacked\">.jpg"));
  images.back().reason = RefusalReason::kNoOverlap;
  images.back().detail = "<img src=\"https://example.org/x.png\" onerror=\"alert(1)\">";
  std::vector<PairEvidence> pairs;
  for (const test_support::SyntheticPair& pair : scene.pairs) {
    pairs.push_back({.pair = pair.pair,
                     .kind = pair.geometry.kind,
                     .candidates = pair.geometry.candidates,
                     .inliers = pair.geometry.inliers.size()});
  }
  const std::span<const Scene> components(&scene.truth, 1);
  ReportInput input;
  input.components = components;
  input.images = images;
  input.pairs = pairs;
  input.input_description = "synthetic arc";
  return render_report_html(build_report(input), components);
}

TEST_F(ReportPage, DrawsAModel) {
  const test_support::SyntheticScene scene = test_support::make_synthetic_scene({.noise_px = 0.3});
  const Visit visit = open(page_of(scene), "#check");
  expect_sound(visit);
  EXPECT_GT(drawn_pixels(visit), 1000);
  EXPECT_EQ(count_of(visit.dom, "<tr data-image="), scene.truth.views.size() + 1);
  EXPECT_EQ(count_of(visit.dom, "<figure class=\"plot\">"), 3U);
  EXPECT_THAT(visit.dom, HasSubstr("10 of 11 images are registered, 1 is refused."));
}

TEST_F(ReportPage, SaysWhatIsMissing) {
  ReportInput input;
  const std::vector<ImageOutcome> images{outcome_named("a.jpg")};
  input.images = images;
  input.finish =
      FinishSection{false,
                    "Not ready: 5 % is open.",
                    0.05,
                    {{GapKind::kHole, {0, 0, 0}, 0.05, "a.jpg", 40, 0, "<i>go left</i>"}}};
  const Visit visit = open(render_report_html(build_report(input), {}), "");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, HasSubstr("Not ready: 5 % is open."));
  EXPECT_THAT(visit.dom, HasSubstr("&lt;i&gt;go left&lt;/i&gt;"));
}

TEST_F(ReportPage, DrawsTheFramesOfAVideo) {
  ReportInput input;
  const std::vector<VideoFrameSection> frames{
      {"a.jpg", 0.0, FrameVerdict::kKept, {.sharpness = 40.0, .relative_sharpness = 1.0}},
      {"<b>.jpg", 0.03, FrameVerdict::kTooLittleMotion, {.relative_sharpness = 0.9}},
      {"c.jpg", 0.07, FrameVerdict::kBlurred, {.relative_sharpness = 0.2}}};
  input.frames = frames;
  const Visit visit = open(render_report_html(build_report(input), {}), "#check");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, HasSubstr("1 of 3 frames kept"));
  EXPECT_EQ(count_of(visit.dom, "class=\"frame frame-"), 3U);
  EXPECT_THAT(visit.dom, HasSubstr("blurred 1"));
}

TEST_F(ReportPage, DrawsAModelWithoutWebgl) {
  const test_support::SyntheticScene scene = test_support::make_synthetic_scene({.noise_px = 0.3});
  const Visit visit = open(page_of(scene), "#2d-check");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, HasSubstr("data-renderer=\"2d\""));
  EXPECT_GT(drawn_pixels(visit), 1000);
}

TEST_F(ReportPage, DrawsTheMesh) {
  const Visit visit = open(test_support::sample_report_page(), "#check");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, HasSubstr("data-mesh=\"shown\""));
  EXPECT_GT(drawn_pixels(visit), 20'000);
  EXPECT_THAT(visit.dom, HasSubstr("Mesh of 2,208 faces with 2 pages of texture"));
}

TEST_F(ReportPage, SaysWhereTheMeshIsWithoutWebgl) {
  const Visit visit = open(test_support::sample_report_page(), "#2d-check");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, HasSubstr("data-mesh=\"no_webgl\""));
  EXPECT_GT(drawn_pixels(visit), 1000) << "the points are drawn instead";
  EXPECT_THAT(visit.dom, HasSubstr("open textured.glb beside this page"));
}

TEST_F(ReportPage, SaysWhereAMeshIsThatIsTooLarge) {
  const Visit visit = open(test_support::sample_report_page_without_mesh(), "#check");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, HasSubstr("data-mesh=\"too_large\""));
  EXPECT_GT(drawn_pixels(visit), 1000);
  EXPECT_THAT(visit.dom, HasSubstr("too large for this page (24.0 MB): open textured.glb"));
}

TEST_F(ReportPage, ShowsSurfaceAndDepthMaps) {
  const Visit visit = open(test_support::sample_report_page(), "");
  expect_sound(visit);
  EXPECT_EQ(count_of(visit.dom, "<figure class=\"depth\">"),
            std::size_t{test_support::kSampleDepthPictures});
  EXPECT_EQ(count_of(visit.dom, "src=\"data:image/jpeg;base64,"),
            std::size_t{3 * test_support::kSampleDepthPictures});
  EXPECT_THAT(visit.dom, HasSubstr("27.4 dB"));
  EXPECT_THAT(visit.dom, HasSubstr("12.5 m\xC2\xB2"));
  EXPECT_THAT(visit.dom, HasSubstr("Depth maps at half the size of the photographs"));
}

TEST_F(ReportPage, ShowsWhatTheScaleComesFrom) {
  const Visit visit = open(test_support::sample_report_page(), "");
  expect_sound(visit);
  EXPECT_THAT(visit.dom,
              HasSubstr("Lengths are in metres, from 2 known lengths, to 0.13 % (one standard "
                        "deviation). Up is off the card, to 0.12\xC2\xB0."));
  EXPECT_THAT(visit.dom, HasSubstr("markers 0 and 1"));
  EXPECT_THAT(visit.dom, HasSubstr("0.50050 m"));  // 0.5 m * 0.4 / 0.3996
  EXPECT_THAT(visit.dom, HasSubstr("13 / 14"));
}

TEST_F(ReportPage, ShowsHostileNamesAsText) {
  const Visit visit = open(page_of(test_support::make_synthetic_scene({})), "");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, Not(HasSubstr("data-hacked")));
  EXPECT_THAT(visit.dom, Not(HasSubstr("<b id=\"hacked\">")));
  EXPECT_THAT(visit.dom, HasSubstr("&lt;/script&gt;&lt;script&gt;document.body"));
  EXPECT_THAT(visit.dom, HasSubstr("&lt;img src="));
}

TEST_F(ReportPage, SaysWhyThereIsNoModel) {
  std::vector<ImageOutcome> images{outcome_named("only.jpg")};
  images[0].reason = RefusalReason::kNoOverlap;
  ReportInput input;
  input.images = images;
  const Visit visit = open(render_report_html(build_report(input), {}), "#check");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, HasSubstr("one image is not enough"));
  EXPECT_THAT(visit.dom, HasSubstr(std::string(advice(RefusalReason::kNoOverlap)).substr(0, 20)));
  EXPECT_EQ(count_of(visit.dom, "<tr data-image="), 1U);
}

TEST_F(ReportPage, OpensWithoutAnyImage) {
  const Visit visit = open(render_report_html(build_report({}), {}), "");
  expect_sound(visit);
  EXPECT_THAT(visit.dom, HasSubstr("there were no images"));
}

}  // namespace
}  // namespace trigmesh
