#include "sfm/exchange/camera_profile.hpp"

#include <array>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

constexpr const char* kComplete = R"(# a comment
format = 1
name = "left"
serial = "A1"
model = "brown_conrady"
width_px = 640
height_px = 480
fx_px = 533.125
fy_px = 533
cx_px = 341.5
cy_px = 233.25
distortion = [-0.28, 0.04, 0.001, -0.0002]
rms_px = 0.25
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(CameraProfile, ReadsEveryKey) {
  const auto profile = parse_camera_profile(kComplete, "c.toml");
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ(profile->name, "left");
  EXPECT_EQ(profile->serial, "A1");
  EXPECT_EQ(profile->camera.model, CameraModel::kBrownConrady);
  EXPECT_EQ(profile->camera.width_px, 640);
  EXPECT_EQ(profile->camera.height_px, 480);
  EXPECT_EQ(profile->camera.fx_px, 533.125);
  EXPECT_EQ(profile->camera.fy_px, 533.0);
  EXPECT_EQ(profile->camera.cx_px, 341.5);
  EXPECT_EQ(profile->camera.cy_px, 233.25);
  EXPECT_EQ(profile->camera.distortion, (std::array<double, 4>{-0.28, 0.04, 0.001, -0.0002}));
  EXPECT_EQ(profile->rms_px, 0.25);
}

class CameraProfileModels : public ::testing::TestWithParam<CameraModel> {};

TEST_P(CameraProfileModels, RoundTripsBitForBit) {
  CameraProfile profile;
  profile.camera = {GetParam(), 4000, 3000, 1.0 / 3.0 * 1e4, 3000.0, 1999.5, 1e-17, {}};
  for (std::size_t i = 0; i < static_cast<std::size_t>(distortion_count(GetParam())); ++i) {
    profile.camera.distortion[i] = -0.1 / (3.0 + static_cast<double>(i));
  }
  profile.name = "quote \" backslash \\ tab \t umlaut \xC3\xBC";
  profile.rms_px = 0.1 + 0.2;
  const auto text = format_camera_profile(profile);
  ASSERT_TRUE(text) << text.error().message;
  const auto again = parse_camera_profile(*text, "c.toml");
  ASSERT_TRUE(again) << again.error().message << "\n" << *text;
  EXPECT_EQ(*again, profile) << *text;
}

INSTANTIATE_TEST_SUITE_P(All,
                         CameraProfileModels,
                         ::testing::Values(CameraModel::kPinhole,
                                           CameraModel::kRadial,
                                           CameraModel::kBrownConrady,
                                           CameraModel::kKannalaBrandt));

TEST(CameraProfile, RefusesToWriteAnInvalidCamera) {
  CameraProfile profile;
  EXPECT_EQ(format_camera_profile(profile).error().code, ErrorCode::kInvalidArgument);
}

struct BadProfile {
  const char* from;
  const char* to;
  const char* complaint;
};

class CameraProfileRefuses : public ::testing::TestWithParam<BadProfile> {};

TEST_P(CameraProfileRefuses, NamingFileLineAndKey) {
  const std::string text = replaced(kComplete, GetParam().from, GetParam().to);
  const auto profile = parse_camera_profile(text, "c.toml");
  ASSERT_FALSE(profile);
  EXPECT_EQ(profile.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(profile.error().message, HasSubstr(GetParam().complaint));
}

INSTANTIATE_TEST_SUITE_P(
    Texts,
    CameraProfileRefuses,
    ::testing::Values(BadProfile{"fx_px = 533.125", "fx_px = = 1", "c.toml:8"},
                      BadProfile{"fx_px = 533.125", "fx_px = \"wide\"", "c.toml:8: fx_px"},
                      BadProfile{"fx_px = 533.125", "fx_px = nan", "c.toml:8: fx_px"},
                      BadProfile{"fx_px = 533.125", "fx_px = -1.0", "c.toml"},
                      BadProfile{"fx_px = 533.125\n", "", "fx_px: is missing"},
                      BadProfile{
                          "rms_px = 0.25", "rsm_px = 0.25", "c.toml:13: unknown key 'rsm_px'"},
                      BadProfile{"rms_px = 0.25", "rms_px = -0.25", "c.toml:13: rms_px"},
                      BadProfile{"width_px = 640", "width_px = 0", "c.toml:6: width_px"},
                      BadProfile{"width_px = 640", "width_px = 640.5", "c.toml:6: width_px"},
                      BadProfile{"width_px = 640", "width_px = 99999999999", "c.toml:6: width_px"},
                      BadProfile{"brown_conrady", "magic", "c.toml:5: model"},
                      BadProfile{"brown_conrady", "radial", "c.toml:12: distortion"},
                      BadProfile{"0.04", "\"x\"", "c.toml:12: distortion"},
                      BadProfile{"distortion = [-0.28, 0.04, 0.001, -0.0002]\n", "", "distortion"},
                      BadProfile{"format = 1\n", "", "format"}));

TEST(CameraProfile, RefusesALaterFormatBeforeItsUnknownKeys) {
  const auto profile = parse_camera_profile("format = 2\nlens_id = 3\n", "c.toml");
  ASSERT_FALSE(profile);
  EXPECT_EQ(profile.error().code, ErrorCode::kUnsupported);
}

TEST(CameraProfile, RefusesOversizedText) {
  const std::string text = kComplete + std::string(70'000, '\n');
  EXPECT_EQ(parse_camera_profile(text, "c.toml").error().code, ErrorCode::kLimitExceeded);
}

TEST(CameraProfile, RefusesDeepNestingWithoutCrashing) {
  const std::string text = "a = " + std::string(20'000, '[');
  EXPECT_EQ(parse_camera_profile(text, "c.toml").error().code, ErrorCode::kCorruptData);
}

TEST(CameraFile, TakesAProfile) {
  const auto profiles = parse_camera_file(kComplete, "c.toml");
  ASSERT_TRUE(profiles) << profiles.error().message;
  ASSERT_EQ(profiles->size(), 1U);
  EXPECT_EQ(profiles->front().name, "left");
}

TEST(CameraFile, TakesEveryCameraOfAColmapList) {
  const auto profiles = parse_camera_file(
      "# list\n7 PINHOLE 640 480 500 510 320 240\n9 OPENCV 64 48 50 50 32 24 0.1 0.2 0.3 0.4\n",
      "cameras.txt");
  ASSERT_TRUE(profiles) << profiles.error().message;
  ASSERT_EQ(profiles->size(), 2U);
  EXPECT_EQ((*profiles)[0].camera,
            (Camera{CameraModel::kPinhole, 640, 480, 500.0, 510.0, 319.5, 239.5, {}}));
  EXPECT_EQ((*profiles)[1].camera.model, CameraModel::kBrownConrady);
  EXPECT_EQ((*profiles)[1].camera.distortion, (std::array<double, 4>{0.1, 0.2, 0.3, 0.4}));
}

TEST(CameraFile, NamesTheFileOfABrokenColmapList) {
  const auto profiles = parse_camera_file("1 PINHOLE 640 480 wide\n", "cameras.txt");
  ASSERT_FALSE(profiles);
  EXPECT_EQ(profiles.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(profiles.error().message, HasSubstr("cameras.txt"));
}

TEST(CameraFile, RefusesAnEmptyFile) {
  EXPECT_EQ(parse_camera_file("", "cameras.txt").error().code, ErrorCode::kCorruptData);
  EXPECT_EQ(parse_camera_file("# only a comment\n", "cameras.txt").error().code,
            ErrorCode::kCorruptData);
}

TEST(CameraFile, SaysWhichFileIsMissing) {
  const auto profiles = read_camera_file("/nonexistent/camera.toml");
  ASSERT_FALSE(profiles);
  EXPECT_EQ(profiles.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(profiles.error().message, HasSubstr("/nonexistent/camera.toml"));
}

}  // namespace
}  // namespace trigmesh
