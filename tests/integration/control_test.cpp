#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <httplib.h>
#include <sys/socket.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/control/control_server.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

/// A rig that counts what it is asked.
class CountingTarget final : public ControlTarget {
 public:
  Result<ControlStatus> status() override {
    ControlStatus status;
    status.frames = static_cast<std::uint32_t>(stills.load());
    return status;
  }

  Result<> start() override { return fail(ErrorCode::kNoSpace, "the disk is full"); }

  Result<> finish() override { return fail(ErrorCode::kInsufficientData, "nothing is open"); }

  Result<> still() override {
    ++stills;
    return {};
  }

  Result<std::vector<SessionInfo>> sessions() override { return std::vector<SessionInfo>(1); }

  std::atomic<int> stills = 0;
};

class Control : public ::testing::Test {
 protected:
  Control() {
    options_.socket_path = temporary_.path() / "control";
    options_.max_watchers = 1;
    auto server = ControlServer::create(target_, options_);
    EXPECT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
    thread_.emplace([this] { EXPECT_TRUE(server_->run()); });
  }

  ~Control() override {
    server_->stop();
    thread_.reset();
  }

  [[nodiscard]] std::unique_ptr<httplib::Client> client() const {
    auto client = std::make_unique<httplib::Client>(options_.socket_path.string());
    client->set_address_family(AF_UNIX);
    client->set_default_headers({{"Host", "rig"}});
    return client;
  }

  const test_support::TemporaryFolder temporary_;
  ControlOptions options_;
  CountingTarget target_;
  std::unique_ptr<ControlServer> server_;
  std::optional<std::jthread> thread_;
};

TEST_F(Control, PassesCommandsOnAndAnswers) {
  const auto taken = client()->Post("/v1/still");
  ASSERT_TRUE(taken) << httplib::to_string(taken.error());
  EXPECT_EQ(taken->status, 200);
  EXPECT_EQ(target_.stills, 1);
  const auto status = client()->Get("/v1/status");
  ASSERT_TRUE(status);
  EXPECT_THAT(status->body, HasSubstr("\"frames\":1"));
  EXPECT_EQ(status->get_header_value("Content-Type"), "application/json");
  EXPECT_THAT(client()->Get("/v1/sessions")->body, HasSubstr("\"size_bytes\":0"));
}

TEST_F(Control, SaysWhyNot) {
  const auto full = client()->Post("/v1/start");
  ASSERT_TRUE(full);
  EXPECT_EQ(full->status, 507);
  EXPECT_EQ(full->body, R"({"error":"the disk is full"})");
  EXPECT_EQ(client()->Post("/v1/finish")->status, 409);
}

TEST_F(Control, RefusesWhatIsUnknownOrTooLarge) {
  EXPECT_EQ(client()->Get("/v1/other")->status, 404);
  EXPECT_EQ(client()->Get("/v1/still")->status, 404) << "looking does not change anything";
  const std::string body(options_.max_body_bytes + 1, 'x');
  const auto refused = client()->Post("/v1/still", body, "text/plain");
  EXPECT_TRUE(!refused || refused->status == 413);
  EXPECT_EQ(target_.stills, 0);
}

TEST_F(Control, TellsWatchersWhatHappensAndBoundsTheirNumber) {
  server_->publish("phase", R"({"phase":"working"})");
  std::string seen;
  int second_status = 0;
  const httplib::Headers from_the_beginning = {{"Last-Event-ID", "0"}};
  (void)client()->Get("/v1/events", from_the_beginning, [&](const char* data, std::size_t size) {
    seen.append(data, size);
    if (second_status == 0) {
      second_status = client()->Get("/v1/events")->status;
      server_->publish("progress", R"({"ratio":0.5})");
    }
    return seen.find("progress") == std::string::npos;  // false: enough
  });
  EXPECT_EQ(seen,
            "id: 1\nevent: phase\ndata: {\"phase\":\"working\"}\n\n"
            "id: 2\nevent: progress\ndata: {\"ratio\":0.5}\n\n");
  EXPECT_EQ(second_status, 503);
}

TEST_F(Control, StoppingEndsWatching) {
  server_->publish("phase", "{}");
  const httplib::Headers from_the_beginning = {{"Last-Event-ID", "0"}};
  (void)client()->Get("/v1/events", from_the_beginning, [&](const char*, std::size_t) {
    server_->stop();
    return true;
  });
  thread_.reset();  // would wait for ever
}

TEST(ControlServer, StopsBeforeItHasBegun) {
  const test_support::TemporaryFolder temporary;
  CountingTarget target;
  auto server = ControlServer::create(target, {.socket_path = temporary.path() / "control"});
  ASSERT_TRUE(server) << server.error().message;
  (*server)->stop();
  EXPECT_TRUE((*server)->run());
}

TEST(ControlServer, SaysWhereItCannotListen) {
  CountingTarget target;
  const auto missing = ControlServer::create(target, {.socket_path = "/nonexistent/control"});
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("/nonexistent/control"));
  const auto too_long = ControlServer::create(target, {.socket_path = std::string(200, 'x')});
  ASSERT_FALSE(too_long);
  EXPECT_EQ(too_long.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
