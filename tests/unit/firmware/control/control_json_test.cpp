#include "firmware/control/control_json.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(ControlJson, SaysWhatTheRigDoes) {
  ControlStatus status;
  status.phase = RigPhase::kCapturing;
  status.camera_present = true;
  status.storage = StorageLevel::kLow;
  status.session_id = "20240229T235959Z-00ff00";
  status.frames = 3;
  status.job = JobState::kPaused;
  status.queued_models = 1;
  status.available_bytes = 5;
  status.software_version = "1.0";
  EXPECT_EQ(
      render_status(status),
      R"({"phase":"capturing","camera_present":true,"storage":"low",)"
      R"("session":"20240229T235959Z-00ff00","frames":3,"advice":"","job":"paused","queued_models":1,)"
      R"("available_bytes":5,"software_version":"1.0","session_root":"","fault":"","model_session":"",)"
      R"("model_stage":"","model_done":0,"model_total":0,"last_event":0})");
}

TEST(ControlJson, ListsSessions) {
  SessionInfo session;
  session.manifest.id = "20240229T235959Z-00ff00";
  session.manifest.state = SessionState::kModelReady;
  session.manifest.mode = "still";
  session.manifest.frame_count = 12;
  session.has_model = true;
  session.size_bytes = 99;
  EXPECT_EQ(render_sessions(std::vector{session}),
            R"([{"id":"20240229T235959Z-00ff00","state":"model_ready","mode":"still","frames":12,)"
            R"("has_model":true,"exported":false,"size_bytes":99}])");
  EXPECT_EQ(render_sessions({}), "[]");
}

TEST(ControlJson, ListsDevices) {
  const DeviceInfo camera{"camera", "usb-Example-video-index0", "Example", "/dev/video0"};
  EXPECT_EQ(render_devices(std::vector{camera}),
            R"([{"kind":"camera","name":"usb-Example-video-index0","model":"Example",)"
            R"("note":"/dev/video0"}])");
}

TEST(ControlJson, KeepsErrorsOnOneLine) {
  EXPECT_EQ(render_error("a \"b\"\nc"), R"({"error":"a \"b\"\nc"})");
}

TEST(ControlJson, TellsACallerWhatHeCanDo) {
  EXPECT_EQ(http_status_of(ErrorCode::kNotFound), 404);
  EXPECT_EQ(http_status_of(ErrorCode::kInsufficientData), 409);
  EXPECT_EQ(http_status_of(ErrorCode::kNoSpace), 507);
  EXPECT_EQ(http_status_of(ErrorCode::kIo), 500);
}

TEST(ControlJson, GivesAClientTheErrorBackForItsExitCode) {
  for (const ErrorCode code : {ErrorCode::kInvalidArgument,
                               ErrorCode::kNotFound,
                               ErrorCode::kInsufficientData,
                               ErrorCode::kLimitExceeded,
                               ErrorCode::kNoSpace,
                               ErrorCode::kUnsupported,
                               ErrorCode::kIo}) {
    EXPECT_EQ(error_code_of(http_status_of(code)), code);
  }
}

}  // namespace
}  // namespace trigmesh
