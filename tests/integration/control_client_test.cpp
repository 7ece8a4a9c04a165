#include "firmware/control/control_client.hpp"

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/control/control_parse.hpp"
#include "tests/integration/fake_rig.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using test_support::kReadySession;
using test_support::ServedRig;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ControlClientTest : public ::testing::Test {
 protected:
  [[nodiscard]] ControlOptions server_options() const { return {.socket_path = socket_}; }

  [[nodiscard]] ControlClient client() const { return ControlClient({.socket_path = socket_}); }

  const test_support::TemporaryFolder temporary_;
  const std::filesystem::path socket_ = temporary_.path() / "control.sock";
};

TEST_F(ControlClientTest, AsksAndGetsAnswersAndErrors) {
  ServedRig served(server_options());
  EXPECT_TRUE(client().check_connection());
  const auto status = client().get("/v1/status").and_then(parse_status);
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(status->phase, RigPhase::kIdle);
  EXPECT_TRUE(client().post("/v1/still"));
  EXPECT_TRUE(client().remove(std::string("/v1/sessions/") + kReadySession));
  const auto exported = client().post_and_wait(
      std::string("/v1/sessions/") + kReadySession + "/export", R"({"destination":"/mnt"})");
  ASSERT_TRUE(exported) << exported.error().message;
  EXPECT_EQ(parse_export(*exported).value().file_count, 15U);
  served.rig().refuse_with(Error{ErrorCode::kNoSpace, "the disk is full"});
  const auto refused = client().post("/v1/start");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kNoSpace);
  EXPECT_EQ(refused.error().message, "the disk is full");
}

TEST_F(ControlClientTest, SaysWhatToDoWhenNobodyListens) {
  const auto missing = client().get("/v1/status");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kIo);
  EXPECT_THAT(missing.error().message, HasSubstr("is trigmeshd running?"));
  EXPECT_THAT(missing.error().message, HasSubstr(socket_.string()));
  { const ServedRig served(server_options()); }
  const auto gone = client().post("/v1/still");
  ASSERT_FALSE(gone);
  EXPECT_THAT(gone.error().message, HasSubstr("is trigmeshd running?"));
  const std::stop_source never;
  ControlClientOptions impatient{.socket_path = socket_};
  impatient.reconnect_for = std::chrono::milliseconds(0);
  const auto watched = ControlClient(impatient).watch(
      0, [](const ControlEvent&) { return true; }, never.get_token());
  ASSERT_FALSE(watched);
  EXPECT_THAT(watched.error().message, HasSubstr("is trigmeshd running?"));
}

/// Somebody else, in a process of his own: root may connect to everything.
TEST_F(ControlClientTest, SaysWhatToDoWithoutPermission) {
  constexpr uid_t kNobody = 65534;
  ASSERT_EQ(::chmod(temporary_.path().c_str(), 0), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const bool is_somebody_else = ::geteuid() != 0 || ::setuid(kNobody) == 0;
    const auto refused = client().check_connection();
    const bool told =
        !refused && refused.error().message.find("group trigmesh") != std::string::npos;
    ::_exit(is_somebody_else && told ? 0 : 1);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(::chmod(temporary_.path().c_str(), S_IRWXU), 0);
}

TEST_F(ControlClientTest, RefusesASocketPathThatIsTooLong) {
  const ControlClient client({.socket_path = std::string(200, 'x')});
  EXPECT_EQ(client.check_connection().error().code, ErrorCode::kInvalidArgument);
}

TEST_F(ControlClientTest, WatchesFromAnEventOn) {
  ServedRig served(server_options());
  for (const char* data : {"1", "2", "3"}) {
    served.server().publish("test", data);
  }
  std::vector<std::string> seen;
  const std::stop_source never;
  const auto watched = client().watch(
      1,
      [&](const ControlEvent& event) {
        seen.push_back(event.data);
        return event.number < 3;
      },
      never.get_token());
  EXPECT_TRUE(watched) << watched.error().message;
  EXPECT_THAT(seen, ElementsAre("2", "3"));
}

TEST_F(ControlClientTest, StopsWatchingWhenAsked) {
  ServedRig served(server_options());
  std::stop_source stop;
  served.server().publish("test", "1");
  const auto watched = client().watch(
      0,
      [&](const ControlEvent&) {
        stop.request_stop();  // ends the connection, without an event
        return true;
      },
      stop.get_token());
  EXPECT_TRUE(watched) << watched.error().message;
}

TEST_F(ControlClientTest, GoesOnWatchingAfterARestartOfTheService) {
  auto served = std::make_unique<ServedRig>(server_options());
  served->server().publish("test", "before");
  std::vector<std::string> seen;
  const std::stop_source never;
  std::jthread restart;
  const auto watched = client().watch(
      0,
      [&](const ControlEvent& event) {
        seen.push_back(event.data);
        if (event.data == "before") {
          restart = std::jthread([&] {
            served.reset();
            served = std::make_unique<ServedRig>(server_options());
            served->server().publish("test", "one");
            served->server().publish("test", "after");
          });
          return true;
        }
        return event.data != "after";
      },
      never.get_token());
  EXPECT_TRUE(watched) << watched.error().message;
  EXPECT_EQ(seen.front(), "before");
  EXPECT_EQ(seen.back(), "after");
}

TEST_F(ControlClientTest, SaysThatTooManyWatch) {
  ServedRig served({.socket_path = socket_, .max_watchers = 1});
  served.server().publish("test", "1");
  Result<> second;
  const std::stop_source never;
  const auto first = client().watch(
      0,
      [&](const ControlEvent&) {
        second = client().watch(
            0, [](const ControlEvent&) { return false; }, never.get_token());
        return false;
      },
      never.get_token());
  EXPECT_TRUE(first);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kLimitExceeded);
}

}  // namespace
}  // namespace trigmesh
