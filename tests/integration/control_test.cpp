#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include <httplib.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/base/unique_fd.hpp"
#include "firmware/control/control_server.hpp"
#include "tests/integration/fake_rig.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using test_support::kReadySession;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kJson = "application/json";

/// What the rig answers to the bytes of a request, until it closes the connection.
std::string answer_to(const std::filesystem::path& socket_path, std::string_view request) {
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  socket_path.native().copy(address.sun_path, sizeof(address.sun_path) - 1);
  const UniqueFd connection(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (::connect(connection.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) !=
          0 ||
      ::send(connection.get(), request.data(), request.size(), MSG_NOSIGNAL) !=
          static_cast<ssize_t>(request.size())) {
    return {};
  }
  std::string answer;
  std::array<char, 512> part{};
  for (ssize_t count = 0; (count = ::recv(connection.get(), part.data(), part.size(), 0)) > 0;) {
    answer.append(part.data(), static_cast<std::size_t>(count));
  }
  return answer;
}

class Control : public ::testing::Test {
 protected:
  Control() : options_{.socket_path = temporary_.path() / "control", .max_watchers = 1} {}

  [[nodiscard]] std::unique_ptr<httplib::Client> client() const {
    auto client = std::make_unique<httplib::Client>(options_.socket_path.string());
    client->set_address_family(AF_UNIX);
    client->set_default_headers({{"Host", "rig"}});
    return client;
  }

  const test_support::TemporaryFolder temporary_;
  const ControlOptions options_;
  test_support::ServedRig served_{options_};
  ControlServer& server_ = served_.server();
};

TEST_F(Control, PassesCommandsOnAndAnswers) {
  for (const char* command : {"start", "still", "undo", "finish", "cancel"}) {
    const auto taken = client()->Post(std::string("/v1/") + command);
    ASSERT_TRUE(taken) << httplib::to_string(taken.error());
    EXPECT_EQ(taken->status, 200);
    EXPECT_EQ(taken->body, "{}");
  }
  EXPECT_THAT(served_.rig().asked(), ElementsAre("start", "still", "undo", "finish", "cancel"));
}

TEST_F(Control, SaysWhatThereIs) {
  server_.publish("phase", "{}");
  const auto status = client()->Get("/v1/status");
  ASSERT_TRUE(status);
  EXPECT_THAT(status->body, HasSubstr("\"last_event\":1"));
  EXPECT_EQ(status->get_header_value("Content-Type"), "application/json");
  EXPECT_THAT(client()->Get("/v1/sessions")->body, HasSubstr("\"size_bytes\":999"));
  EXPECT_THAT(client()->Get("/v1/devices")->body, HasSubstr("\"name\":\"gpiochip0\""));
}

TEST_F(Control, RemovesAndExportsASession) {
  const std::string session = std::string("/v1/sessions/") + kReadySession;
  const auto exported =
      client()->Post(session + "/export", R"({"destination":"/media/stick"})", kJson);
  ASSERT_TRUE(exported);
  EXPECT_EQ(exported->status, 200);
  EXPECT_THAT(exported->body, HasSubstr("\"files\":15"));
  EXPECT_EQ(client()->Delete(session)->status, 200);
  EXPECT_THAT(served_.rig().asked(),
              ElementsAre(std::string("export ") + kReadySession + " /media/stick",
                          std::string("remove ") + kReadySession));
}

TEST_F(Control, RefusesWrongIdsAndRequestsBeforeTheRigSeesThem) {
  const std::string request = R"({"destination":"/media/stick"})";
  EXPECT_EQ(client()->Delete("/v1/sessions/..")->status, 400);
  EXPECT_EQ(client()->Delete("/v1/sessions/20240229T235959Z-00ff0g")->status, 400);
  EXPECT_EQ(client()->Post("/v1/sessions/x/export", request, kJson)->status, 400);
  EXPECT_EQ(client()->Delete("/v1/sessions/20240229T235959Z-000000")->status, 404);
  const std::string session = std::string("/v1/sessions/") + kReadySession;
  for (const char* wrong : {"", "{", R"({"destination":"stick"})", R"({"destination":7})"}) {
    EXPECT_EQ(client()->Post(session + "/export", wrong, kJson)->status, 400) << wrong;
  }
  EXPECT_EQ(client()->Get(session + "/export")->status, 404);
  EXPECT_EQ(client()->Delete("/v1/sessions/" + std::string(3000, 'x'))->status, 400);
  EXPECT_THAT(served_.rig().asked(), IsEmpty());
}

TEST_F(Control, SaysWhyNot) {
  served_.rig().refuse_with(Error{ErrorCode::kNoSpace, "the disk is full"});
  const auto full = client()->Post("/v1/start");
  ASSERT_TRUE(full);
  EXPECT_EQ(full->status, 507);
  EXPECT_EQ(full->body, R"({"error":"the disk is full"})");
  served_.rig().refuse_with(Error{ErrorCode::kInsufficientData, "nothing is open"});
  EXPECT_EQ(client()->Post("/v1/finish")->status, 409);
}

TEST_F(Control, RefusesWhatIsUnknownOrTooLarge) {
  EXPECT_EQ(client()->Get("/v1/other")->status, 404);
  EXPECT_EQ(client()->Get("/v1/still")->status, 404) << "looking does not change anything";
  const std::string body(options_.max_body_bytes + 1, 'x');
  const auto refused = client()->Post("/v1/still", body, "text/plain");
  EXPECT_TRUE(!refused || refused->status == 413);
  EXPECT_THAT(served_.rig().asked(), IsEmpty());
}

TEST_F(Control, RefusesAPostOfUnknownLengthInsteadOfWaitingForItsBody) {
  const std::string answer =
      answer_to(options_.socket_path, "POST /v1/still HTTP/1.1\r\nHost: rig\r\n\r\n");
  EXPECT_THAT(answer, HasSubstr(" 411 "));
  EXPECT_THAT(answer, HasSubstr("--data ''"));
  EXPECT_THAT(served_.rig().asked(), IsEmpty());
}

TEST_F(Control, AnswersOthersDuringALongExport) {
  std::string seen;
  served_.rig().on_command([&](const std::string&) { seen = client()->Get("/v1/status")->body; });
  EXPECT_EQ(client()
                ->Post(std::string("/v1/sessions/") + kReadySession + "/export",
                       R"({"destination":"/media/stick"})",
                       kJson)
                ->status,
            200);
  EXPECT_THAT(seen, HasSubstr("\"phase\""));
}

TEST_F(Control, TellsWatchersWhatHappensAndBoundsTheirNumber) {
  server_.publish("phase", R"({"phase":"working"})");
  std::string seen;
  int second_status = 0;
  const httplib::Headers from_the_beginning = {{"Last-Event-ID", "0"}};
  (void)client()->Get("/v1/events", from_the_beginning, [&](const char* data, std::size_t size) {
    seen.append(data, size);
    if (second_status == 0) {
      second_status = client()->Get("/v1/events")->status;
      server_.publish("progress", R"({"ratio":0.5})");
    }
    return seen.find("progress") == std::string::npos;  // false: enough
  });
  EXPECT_EQ(seen,
            "id: 1\nevent: phase\ndata: {\"phase\":\"working\"}\n\n"
            "id: 2\nevent: progress\ndata: {\"ratio\":0.5}\n\n");
  EXPECT_EQ(second_status, 503);
}

TEST_F(Control, StoppingEndsWatching) {
  server_.publish("phase", "{}");
  const httplib::Headers from_the_beginning = {{"Last-Event-ID", "0"}};
  (void)client()->Get("/v1/events", from_the_beginning, [&](const char*, std::size_t) {
    server_.stop();
    return true;
  });
  served_.stop();  // would wait for ever
}

TEST(ControlServer, StopsBeforeItHasBegun) {
  const test_support::TemporaryFolder temporary;
  test_support::FakeRig target;
  auto server = ControlServer::create(target, {.socket_path = temporary.path() / "control"});
  ASSERT_TRUE(server) << server.error().message;
  (*server)->stop();
  EXPECT_TRUE((*server)->run());
}

TEST(ControlServer, SaysWhereItCannotListen) {
  test_support::FakeRig target;
  const auto missing = ControlServer::create(target, {.socket_path = "/nonexistent/control"});
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("/nonexistent/control"));
  const auto too_long = ControlServer::create(target, {.socket_path = std::string(200, 'x')});
  ASSERT_FALSE(too_long);
  EXPECT_EQ(too_long.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
