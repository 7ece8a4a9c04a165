#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/run_program.hpp"

namespace trigmesh::test_support {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

TEST(CommandLine, TellsItsVersion) {
  const ProgramResult result = run_trigmesh({"--version"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, MatchesRegex("trigmesh [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(CommandLine, HelpShowsExamplesAndExitCodes) {
  const ProgramResult result = run_trigmesh({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("Examples:"));
  EXPECT_THAT(result.out, HasSubstr("Exit codes:"));
  for (const char* command : {"evaluate", "export"}) {
    const ProgramResult help = run_trigmesh({command, "--help"});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_THAT(help.out, HasSubstr("Examples:"));
  }
}

TEST(CommandLine, UsageErrorsEndWithTwoAndOneMessage) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{},
        {"nonsense"},
        {"export"},
        {"export", "model", "--format", "vrml", "--output", "x"},
        {"evaluate", "model", "--truth", "t", "--max-rmse", "-1"}}) {
    const ProgramResult result = run_trigmesh(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.out, IsEmpty());
    EXPECT_THAT(result.err, StartsWith("trigmesh: "));
    EXPECT_EQ(result.err.find("trigmesh: ", 1), std::string::npos) << result.err;
  }
}

}  // namespace
}  // namespace trigmesh::test_support
