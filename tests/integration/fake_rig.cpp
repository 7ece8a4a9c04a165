#include "tests/integration/fake_rig.hpp"

#include <utility>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace trigmesh::test_support {

Result<> FakeRig::command(const std::string& what) {
  std::function<void(const std::string&)> hook;
  std::optional<Error> refusal;
  {
    const std::lock_guard lock(mutex_);
    asked_.push_back(what);
    hook = hook_;
    refusal = refusal_;
  }
  if (hook) {
    hook(what);
  }
  return refusal ? Result<>(tl::unexpected<Error>(*refusal)) : Result<>();
}

Result<ControlStatus> FakeRig::status() {
  std::function<void()> hook;
  {
    const std::lock_guard lock(mutex_);
    hook = status_hook_;
  }
  if (hook) {
    hook();
  }
  const std::lock_guard lock(mutex_);
  return status_;
}

Result<std::vector<SessionInfo>> FakeRig::sessions() {
  SessionInfo ready;
  ready.manifest.id = kReadySession;
  ready.manifest.state = SessionState::kModelReady;
  ready.manifest.mode = "video";
  ready.manifest.frame_count = 12;
  ready.manifest.exported = true;
  ready.has_model = true;
  ready.size_bytes = 34'567'890;
  SessionInfo closed;
  closed.manifest.id = kClosedSession;
  closed.manifest.state = SessionState::kClosed;
  closed.manifest.mode = "still";
  closed.size_bytes = 999;
  return std::vector{ready, closed};
}

Result<> FakeRig::continue_session(const std::string& id) {
  if (id != kReadySession && id != kClosedSession) {
    return fail(ErrorCode::kNotFound, "there is no session {}", id);
  }
  return command("continue " + id);
}

Result<> FakeRig::remove_session(const std::string& id) {
  if (id != kReadySession && id != kClosedSession) {
    return fail(ErrorCode::kNotFound, "there is no session {}", id);
  }
  return command("remove " + id);
}

Result<ExportReport> FakeRig::export_session(const std::string& id,
                                             const std::filesystem::path& destination) {
  return command(fmt::format("export {} {}", id, destination.string())).map([&] {
    return ExportReport{destination / id, 15, 34'567'890};
  });
}

Result<std::vector<DeviceInfo>> FakeRig::devices() {
  return std::vector<DeviceInfo>{{"camera", "usb-Example-video-index0", "Example", "/dev/video0"},
                                 {"gpio chip", "gpiochip0", "pinctrl-example", ""}};
}

std::vector<std::string> FakeRig::asked() const {
  const std::lock_guard lock(mutex_);
  return asked_;
}

void FakeRig::set_status(const ControlStatus& status) {
  const std::lock_guard lock(mutex_);
  status_ = status;
}

void FakeRig::refuse_with(std::optional<Error> error) {
  const std::lock_guard lock(mutex_);
  refusal_ = std::move(error);
}

void FakeRig::on_command(std::function<void(const std::string&)> hook) {
  const std::lock_guard lock(mutex_);
  hook_ = std::move(hook);
}

void FakeRig::on_status(std::function<void()> hook) {
  const std::lock_guard lock(mutex_);
  status_hook_ = std::move(hook);
}

ServedRig::ServedRig(const ControlOptions& options) {
  auto server = ControlServer::create(rig_, options);
  EXPECT_TRUE(server) << server.error().message;
  server_ = std::move(*server);
  thread_ = std::jthread([this] { EXPECT_TRUE(server_->run()); });
}

ServedRig::~ServedRig() {
  stop();
}

void ServedRig::stop() {
  server_->stop();
  if (thread_.joinable()) {
    thread_.join();
  }
}

}  // namespace trigmesh::test_support
