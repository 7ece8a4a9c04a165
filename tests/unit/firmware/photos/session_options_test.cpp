#include "firmware/photos/session_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/base/file_system.hpp"
#include "firmware/session/manifest.hpp"
#include "tests/support/demo_session.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class SessionOptions : public ::testing::Test {
 protected:
  void write(const std::string& settings, const std::string& profile) {
    SessionManifest manifest;
    manifest.id = "20260101T000000Z-abcdef";
    manifest.mode = "video";
    manifest.settings = settings;
    manifest.camera_profile = profile;
    ASSERT_TRUE(write_manifest(real_file_system(), folder_.path(), manifest));
  }

  test_support::TemporaryFolder folder_;
};

TEST_F(SessionOptions, AreThoseThatTheSessionWasCapturedWith) {
  write("[reconstruction]\npreset = \"fine\"\nseed = 7\nthreads = 3\nmemory_limit_mb = 900\n",
        test_support::demo_camera_profile());
  const auto options = options_of_session(folder_.path(), "1.2");
  ASSERT_TRUE(options) << options.error().message;
  EXPECT_EQ(options->build.preset, QualityPreset::kFine);
  EXPECT_EQ(options->seed, 7U);
  EXPECT_EQ(options->num_threads, 3);
  EXPECT_EQ(options->memory_limit_bytes, 900'000'000U);
  EXPECT_EQ(options->software_version, "1.2");
  EXPECT_THAT(options->cameras, SizeIs(1));
}

TEST_F(SessionOptions, WithoutAProfileNoCameraIsKnown) {
  write("", "");
  const auto options = options_of_session(folder_.path(), "1.2");
  ASSERT_TRUE(options) << options.error().message;
  EXPECT_THAT(options->cameras, IsEmpty());
  EXPECT_GE(options->num_threads, 1);
}

TEST_F(SessionOptions, SayWhatCannotBeRead) {
  EXPECT_EQ(options_of_session(folder_.path(), "").error().code, ErrorCode::kNotFound);
  write("[reconstruction]\nseed = \"x\"\n", "");
  const auto wrong = options_of_session(folder_.path(), "");
  EXPECT_EQ(wrong.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(wrong.error().message, HasSubstr("settings of session 20260101T000000Z-abcdef:2"));
  write("", "nonsense");
  EXPECT_FALSE(options_of_session(folder_.path(), ""));
}

}  // namespace
}  // namespace trigmesh
