#include "firmware/settings/settings.hpp"

#include <map>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/base/file_bytes.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

std::string complaint(const std::string& text) {
  const auto settings = parse_settings(text, "f");
  return settings ? "accepted" : settings.error().message;
}

TEST(Settings, TheShippedFileIsTheDefaults) {
  const auto text = read_file(TRIGMESH_SETTINGS_FILE, kMaxSettingsBytes);
  ASSERT_TRUE(text) << text.error().message;
  EXPECT_EQ(*text, render_settings(Settings{}));
  const auto settings = load_settings(TRIGMESH_SETTINGS_FILE);
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(*settings, Settings{});
}

TEST(Settings, AnEmptyFileIsTheDefaults) {
  EXPECT_EQ(parse_settings("", "f").value(), Settings{});
}

TEST(Settings, ReadsEveryKindOfValue) {
  const auto settings = parse_settings(
      "[camera]\ndevice = '/dev/v4l/by-id/a'\nexposure_us = 5000\ngain = 2\nlock_controls = false\n"
      "[capture]\nmode = 'still'\n[storage]\nquota_mb = 2000000000\n",
      "f");
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->camera.device, "/dev/v4l/by-id/a");
  EXPECT_EQ(settings->camera.exposure, std::chrono::milliseconds(5));
  EXPECT_EQ(settings->camera.gain, 2.0);
  EXPECT_FALSE(settings->camera.lock_controls);
  EXPECT_EQ(settings->capture.mode, CaptureSettings::Mode::kStill);
  EXPECT_EQ(settings->storage.quota_mb, 2'000'000'000);
}

TEST(Settings, ReadsTablesOfMarkers) {
  const auto settings = parse_settings(
      "[scale]\nmarker_side_m = 0.1\nmarker_sides_m = { 3 = 0.12, 7 = 0.05 }\n"
      "marker_distances_m = { 0-1 = 0.5, 3-2 = 1 }\nup = 'card'\n",
      "f");
  ASSERT_TRUE(settings) << settings.error().message;
  EXPECT_EQ(settings->scale.marker_side_m, 0.1);
  EXPECT_EQ(settings->scale.marker_sides_m, (std::map<int, double>{{3, 0.12}, {7, 0.05}}));
  EXPECT_EQ(settings->scale.marker_distances_m,
            (std::map<std::pair<int, int>, double>{{{0, 1}, 0.5}, {{2, 3}, 1.0}}));
  EXPECT_EQ(settings->scale.up, ScaleSettings::Up::kCard);
  const auto as_section = parse_settings("[scale.marker_sides_m]\n3 = 0.12\n", "f");
  ASSERT_TRUE(as_section) << as_section.error().message;
  EXPECT_EQ(as_section->scale.marker_sides_m.at(3), 0.12);
}

TEST(Settings, SaysWhatIsWrongInATable) {
  EXPECT_EQ(complaint("[scale]\nmarker_sides_m = 0.1\n"),
            "f:2: scale.marker_sides_m: must be a table of the number of a marker = number (m)");
  EXPECT_EQ(complaint("[scale]\nmarker_sides_m = { x = 0.1 }\n"),
            "f:2: scale.marker_sides_m.x: the key must be the number of a marker (m)");
  EXPECT_EQ(complaint("[scale]\nmarker_sides_m = { 1000 = 0.1 }\n"),
            "f:2: scale.marker_sides_m.1000: the key must be the number of a marker (m)");
  EXPECT_EQ(complaint("[scale]\nmarker_sides_m = { 3 = 25 }\n"),
            "f:2: scale.marker_sides_m.3: must be a number in [0.001, 2] (m)");
  EXPECT_THAT(complaint("[scale]\nmarker_sides_m = { 3 = 'wide' }\n"), HasSubstr("a number in"));
  EXPECT_THAT(complaint("[scale]\nmarker_sides_m = { 3 = 0.1, 03 = 0.1 }\n"),
              HasSubstr("is there already"));
  for (const char* key : {"0", "0-", "-1", "1-1", "0-1-2", "a-b"}) {
    EXPECT_THAT(complaint(std::string("[scale]\nmarker_distances_m = { ") + key + " = 0.5 }\n"),
                HasSubstr("the numbers of two markers"))
        << key;
  }
  EXPECT_THAT(complaint("[scale]\nmarker_distances_m = { 0-1 = 0.5, 1-0 = 0.5 }\n"),
              HasSubstr("is there already"));
}

TEST(Settings, WritesWhatItReads) {
  Settings settings;
  settings.camera.device = "a \"quoted\" \\ name";
  settings.camera.gain = 1.0 / 3.0;
  settings.camera.focus_dioptres = 2.0;
  settings.trigger.double_press = std::chrono::milliseconds(0);
  settings.log.level = LogSettings::Level::kDebug;
  settings.storage.remove_old = StorageSettings::Removal::kWhenNeeded;
  settings.scale.dictionary = ScaleSettings::Dictionary::kBits6Of250;
  settings.scale.marker_sides_m = {{0, 0.1}, {249, 1.0 / 3.0}};
  settings.scale.marker_distances_m = {{{0, 249}, 2.0}};
  settings.scale.up = ScaleSettings::Up::kCard;
  const auto again = parse_settings(render_settings(settings), "f");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(*again, settings);
}

TEST(Settings, SaysFileLineKeyAndWhatItMustBe) {
  EXPECT_EQ(complaint("\n[camera]\nwidth_px = 5\n"),
            "f:3: camera.width_px: must be a whole number in [64, 16384] (px)");
  EXPECT_EQ(complaint("[capture]\nmode = 'stil'\n"),
            "f:2: capture.mode: must be one of \"still\", \"video\"");
  EXPECT_EQ(complaint("[camera]\ngain = 'much'\n"),
            "f:2: camera.gain: must be a number in [0, 64] (1 = none)");
  EXPECT_THAT(complaint("[camera]\ngain = nan\n"), HasSubstr("must be a number"));
  EXPECT_EQ(complaint("[trigger]\nactive_low = 1\n"),
            "f:2: trigger.active_low: must be true or false");
  EXPECT_THAT(complaint("[camera]\ndevice = 5\n"), HasSubstr("must be one line in quotes"));
  EXPECT_THAT(complaint("[camera]\ndevice = \"a\\nb\"\n"), HasSubstr("must be one line"));
  EXPECT_THAT(complaint("[camera]\nwidth_px = 640.0\n"), HasSubstr("whole number"));
  EXPECT_EQ(complaint("camera = 3\n"), "f:1: camera: must be a section, [camera]");
}

TEST(Settings, NamesTheNearestKey) {
  EXPECT_EQ(complaint("[camera]\nwitdh_px = 640\n"),
            "f:2: camera.witdh_px: no such key; the nearest is width_px");
  EXPECT_EQ(complaint("[storge]\n"), "f:1: storge: no such section; the nearest is [storage]");
}

TEST(Settings, TellsEverythingThatIsWrongInTheOrderOfTheFile) {
  EXPECT_EQ(complaint("[log]\nlevel = 'loud'\n[camera]\nrate_hz = 0\n[typo]\n"),
            "f:2: log.level: must be one of \"error\", \"warn\", \"info\", \"debug\"\n"
            "f:4: camera.rate_hz: must be a whole number in [1, 240] (frames/s)\n"
            "f:5: typo: no such section; the nearest is [log]");
}

TEST(Settings, RefusesValuesThatDoNotGoTogether) {
  EXPECT_EQ(complaint("[trigger]\ndebounce_ms = 100\ndouble_press_ms = 50\n"),
            "f:3: trigger.double_press_ms: must be 0 or longer than debounce_ms");
  EXPECT_EQ(complaint("[indicator]\nbuzzer_line = 27\n"),
            "f:2: indicator.buzzer_line: is the line of the light already");
  EXPECT_THAT(complaint("[scale]\nmarker_sides_m = { 50 = 0.1 }\n"),
              HasSubstr("f:2: scale.marker_sides_m: a marker is not in the dictionary"));
  EXPECT_THAT(complaint("[scale]\nmarker_distances_m = { 0-50 = 0.1 }\n"),
              HasSubstr("f:2: scale.marker_distances_m: a marker is not in the dictionary"));
  EXPECT_EQ(complaint("[scale]\nmarker_sides_m = { 50 = 0.1 }\ndictionary = '4x4_100'\n"),
            "accepted");
  EXPECT_EQ(complaint("[scale]\nup = 'card'\n"),
            "f:2: scale.up: card needs a side or a distance of markers");
  EXPECT_EQ(complaint("[storage]\nroot = 'sessions'\n"),
            "f:2: storage.root: must be a path that begins with /");
}

TEST(Settings, RefusesWhatIsNoToml) {
  EXPECT_THAT(complaint("[camera\n"), HasSubstr("f:1: "));
  EXPECT_THAT(complaint("[camera]\ngain = 1\ngain = 2\n"), HasSubstr("f:3: "));
  EXPECT_THAT(complaint("[camera]\ngain = " + std::string(1000, '[')), HasSubstr("f:2: "));
  EXPECT_EQ(parse_settings(std::string(kMaxSettingsBytes + 1, ' '), "f").error().code,
            ErrorCode::kLimitExceeded);
  EXPECT_EQ(load_settings("/nonexistent/trigmesh.toml").error().code, ErrorCode::kNotFound);
}

TEST(Settings, BracketsInATextAreOnlyText) {
  Settings settings;
  settings.camera.device = std::string(1000, '[');
  const auto again = parse_settings(render_settings(settings), "f");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(*again, settings);
}

}  // namespace
}  // namespace trigmesh
