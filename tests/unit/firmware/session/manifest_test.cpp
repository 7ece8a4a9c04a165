#include "firmware/session/manifest.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

SessionManifest example() {
  SessionManifest manifest;
  manifest.id = "20240229T235959Z-00ff00";
  manifest.state = SessionState::kModelFailed;
  manifest.created_wall = std::chrono::nanoseconds(-3);
  manifest.frame_count = 12;
  manifest.mode = "still";
  manifest.camera_profile = "name = \"a\"\n";
  manifest.software_version = "1.2.3";
  manifest.settings = "[capture]\n";
  manifest.recoveries = 1;
  manifest.exported = true;
  return manifest;
}

std::string changed(const std::string& from, const std::string& to) {
  std::string text = render_manifest(example());
  text.replace(text.find(from), from.size(), to);
  return text;
}

TEST(Manifest, IsReadAsItWasWritten) {
  const auto parsed = parse_manifest(render_manifest(example()), "session.json");
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(*parsed, example());
}

TEST(Manifest, NamesTheKeyThatIsWrong) {
  const auto message = [](const std::string& from, const std::string& to) {
    const auto parsed = parse_manifest(changed(from, to), "f");
    return parsed ? std::string("accepted") : parsed.error().message;
  };
  EXPECT_THAT(message("model_failed", "asleep"), HasSubstr("f: \"state\""));
  EXPECT_THAT(message(": 12", ": -1"), HasSubstr("f: \"frame_count\""));
  EXPECT_THAT(message(": 12", ": 5000000000"), HasSubstr("f: \"frame_count\""));
  EXPECT_THAT(message("true", "1"), HasSubstr("f: \"exported\""));
  EXPECT_THAT(message("20240229", "../../.."), HasSubstr("f: \"id\""));
  EXPECT_THAT(message("\"format\": 1", "\"format\": 2"), HasSubstr("format 2"));
  EXPECT_THAT(message("{", "["), HasSubstr("not a JSON object"));
}

TEST(Manifest, SurvivesTextsThatAreNoUtf8) {
  SessionManifest manifest = example();
  manifest.mode.push_back('\xFF');
  EXPECT_TRUE(parse_manifest(render_manifest(manifest), "f"));
}

}  // namespace
}  // namespace trigmesh
