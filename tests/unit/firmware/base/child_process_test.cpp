#include "firmware/base/child_process.hpp"

#include <cerrno>
#include <csignal>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Runs a line of shell and collects what it writes.
Result<ChildExit> run_shell(const std::string& script, std::string& output) {
  return run_child({{"sh", "-c", script},
                    [&output](std::string_view piece) -> Result<> {
                      output.append(piece);
                      return {};
                    }},
                   {});
}

TEST(RunChild, GivesOutputErrorsAndExitCode) {
  std::string output;
  const auto exit = run_shell("echo out; echo err >&2; exit 3", output);
  ASSERT_TRUE(exit.has_value()) << exit.error().message;
  EXPECT_EQ(exit->code, 3);
  EXPECT_EQ(output, "out\n");
  EXPECT_EQ(exit->errors, "err\n");
  EXPECT_FALSE(exit->errors_cut);
}

TEST(RunChild, PassesArgumentsAsTheyAre) {
  std::string output;
  const auto exit = run_child({{"printf", "%s|", "-a b", "it's", "\"$HOME\"", "*", ""},
                               [&output](std::string_view piece) -> Result<> {
                                 output.append(piece);
                                 return {};
                               }},
                              {});
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(output, "-a b|it's|\"$HOME\"|*||");
}

TEST(RunChild, SaysThatAProgramIsMissing) {
  const auto exit = run_child({{"no-such-program-of-trigmesh"}, {}}, {});
  ASSERT_FALSE(exit.has_value());
  EXPECT_EQ(exit.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(exit.error().message, HasSubstr("no-such-program-of-trigmesh"));
}

TEST(RunChild, KeepsTheBeginningOfVeryManyErrors) {
  const auto exit = run_child(
      {{"sh", "-c", "echo first >&2; head -c 1000000 /dev/zero >&2"}, {}, /*max_error_bytes=*/100},
      {});
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(exit->errors.size(), 100U);
  EXPECT_THAT(exit->errors, StartsWith("first\n"));
  EXPECT_TRUE(exit->errors_cut);
}

TEST(RunChild, TellsTheSignalThatEndedIt) {
  std::string output;
  const auto exit = run_shell("kill -9 $$", output);
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(exit->code, 128 + SIGKILL);
}

TEST(RunChild, HasNothingToReadAndNoBlockedSignal) {
  std::string output;
  sigset_t interrupt;
  sigset_t before;
  sigemptyset(&interrupt);
  sigaddset(&interrupt, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &interrupt, &before);
  const auto exit = run_shell("cat; kill -TERM $$; echo still here", output);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(exit->code, 128 + SIGTERM);
  EXPECT_EQ(output, "");
}

/// The program says who it is, then would run for ever.
constexpr const char* kEndless = "echo $$; exec tail -f /dev/null";

TEST(RunChild, EndsAndReapsTheProgramWhenStopped) {
  std::stop_source stop;
  std::string output;
  const auto exit = run_child({{"sh", "-c", kEndless},
                               [&](std::string_view piece) -> Result<> {
                                 output.append(piece);
                                 stop.request_stop();
                                 return {};
                               }},
                              stop.get_token());
  ASSERT_FALSE(exit.has_value());
  EXPECT_EQ(exit.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(::kill(std::stoi(output), 0), -1);
  EXPECT_EQ(errno, ESRCH);
}

TEST(RunChild, DoesNotGoOnWhenStoppedBefore) {
  std::stop_source stop;
  stop.request_stop();
  const auto exit = run_child({{"sh", "-c", kEndless}, {}}, stop.get_token());
  ASSERT_FALSE(exit.has_value());
  EXPECT_EQ(exit.error().code, ErrorCode::kCancelled);
}

TEST(RunChild, EndsTheProgramWhenItsWordsAreRefused) {
  std::string output;
  const auto exit = run_child({{"sh", "-c", kEndless},
                               [&output](std::string_view piece) -> Result<> {
                                 output.append(piece);
                                 return fail(ErrorCode::kCorruptData, "not what was wanted");
                               }},
                              {});
  ASSERT_FALSE(exit.has_value());
  EXPECT_EQ(exit.error().message, "not what was wanted");
  EXPECT_EQ(::kill(std::stoi(output), 0), -1);
}

}  // namespace
}  // namespace trigmesh
