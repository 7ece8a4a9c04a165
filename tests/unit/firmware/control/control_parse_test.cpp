#include "firmware/control/control_parse.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/control/control_json.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

TEST(ControlParse, ReadsTheStatusThatTheServerWrites) {
  ControlStatus status;
  status.phase = RigPhase::kFault;
  status.storage = StorageLevel::kFull;
  status.session_id = "20240229T235959Z-00ff00";
  status.frames = 7;
  status.advice = "too fast";
  status.job = JobState::kPausing;
  status.available_bytes = std::uint64_t{1} << 40U;
  status.fault = "no camera";
  status.model_session_id = "20240229T235958Z-00ff00";
  status.model_stage = "mapping";
  status.model_done = 3;
  status.model_total = 4;
  status.last_event = 99;
  const std::string text = render_status(status);
  const auto read = parse_status(text);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(render_status(*read), text);
}

TEST(ControlParse, ReadsListsThatTheServerWrites) {
  SessionInfo session;
  session.manifest.id = "20240229T235959Z-00ff00";
  session.manifest.state = SessionState::kModelFailed;
  session.manifest.mode = "video";
  session.manifest.frame_count = 12;
  session.manifest.exported = true;
  session.size_bytes = 99;
  const std::string sessions = render_sessions(std::vector{session, session});
  const auto read = parse_sessions(sessions);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(render_sessions(*read), sessions);
  const std::vector<DeviceInfo> devices{{"gpio chip", "gpiochip0", "pinctrl", "54 lines"}};
  EXPECT_EQ(parse_devices(render_devices(devices)).value(), devices);
}

TEST(ControlParse, ReadsTheAnswerToAnExport) {
  const auto read = parse_export(render_export({"/media/stick/x", 3, 1000}));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->folder, "/media/stick/x");
  EXPECT_EQ(read->file_count, 3U);
  EXPECT_EQ(read->size_bytes, 1000U);
}

TEST(ControlParse, ReadsEvents) {
  const ModelEvent model{"id", ModelEventOutcome::kNone, "too few"};
  EXPECT_EQ(parse_model_event(render_model_event(model)).value(), model);
  const ProgressEvent progress{"id", "depth", 1, 2};
  EXPECT_EQ(parse_progress_event(render_progress_event(progress)).value(), progress);
  const ExportEvent exported{"id", 1, 2};
  EXPECT_EQ(parse_export_event(render_export_event(exported)).value(), exported);
  EXPECT_EQ(parse_frame_event(render_frame_event("id", 9)).value(), 9U);
  EXPECT_EQ(parse_phase_session(render_phase_event(RigPhase::kIdle, "id")).value(), "id");
  EXPECT_EQ(render_phase_event(RigPhase::kIdle, ""), R"({"phase":"idle","session":""})");
}

TEST(ControlParse, NamesTheKeyThatIsWrong) {
  const auto wrong_type = parse_export(R"({"folder":1,"files":1,"size_bytes":1})");
  ASSERT_FALSE(wrong_type);
  EXPECT_EQ(wrong_type.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(wrong_type.error().message, HasSubstr("\"folder\""));
  const auto negative = parse_frame_event(R"({"frames":-1})");
  ASSERT_FALSE(negative);
  EXPECT_THAT(negative.error().message, HasSubstr("\"frames\""));
  EXPECT_FALSE(parse_frame_event(R"({"frames":4294967296})"));
  EXPECT_FALSE(parse_model_event(R"({"session":"","outcome":"maybe","message":""})"));
  EXPECT_FALSE(parse_status("[]"));
  EXPECT_FALSE(parse_status("no JSON"));
  EXPECT_FALSE(parse_sessions("{}"));
  EXPECT_FALSE(parse_sessions("[1]"));
}

TEST(ControlParse, TakesOnlyAnAbsoluteDestination) {
  EXPECT_EQ(parse_export_request(render_export_request("/media/a \"b\"")).value(),
            "/media/a \"b\"");
  for (const char* wrong : {"",
                            "[]",
                            "{}",
                            R"({"destination":1})",
                            R"({"destination":""})",
                            R"({"destination":"stick"})",
                            R"({"destination":"/a\u0000b"})",
                            R"({"destination":"/a)"}) {
    const auto refused = parse_export_request(wrong);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(refused.error().message, HasSubstr("\"destination\""));
  }
}

TEST(ControlParse, ShowsAnErrorThatIsNoJsonAsItIs) {
  EXPECT_EQ(parse_error(render_error("the disk is full")), "the disk is full");
  EXPECT_EQ(parse_error("<html>"), "<html>");
}

}  // namespace
}  // namespace trigmesh
