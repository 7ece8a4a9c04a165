#include "firmware/base/result.hpp"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "firmware/base/check.hpp"
#include "firmware/base/executor.hpp"

namespace trigmesh {
namespace {

Result<int> half_of(int value) {
  if (value % 2 != 0) {
    return fail(ErrorCode::kInvalidArgument, "{} is odd", value);
  }
  return value / 2;
}

Result<int> quarter_of(int value) {
  TM_ASSIGN_OR_RETURN(const int half, half_of(value));
  TM_ASSIGN_OR_RETURN(const int quarter, half_of(half));
  return quarter;
}

Result<std::unique_ptr<int>> moved(std::unique_ptr<int> value) {
  TM_ASSIGN_OR_RETURN(auto inner, Result<std::unique_ptr<int>>(std::move(value)));
  return inner;
}

Result<> check_even(int value) {
  TM_RETURN_IF_ERROR(half_of(value));
  return {};
}

TEST(Result, PassesValuesOnAndStopsAtTheFirstError) {
  EXPECT_EQ(quarter_of(8), 2);
  const auto failed = quarter_of(6);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(failed.error().message, "3 is odd");
}

TEST(Result, CarriesValuesThatOnlyMove) {
  const auto result = moved(std::make_unique<int>(5));
  ASSERT_TRUE(result);
  EXPECT_EQ(**result, 5);
}

TEST(Result, ReturnIfErrorKeepsTheReason) {
  EXPECT_TRUE(check_even(2));
  EXPECT_EQ(check_even(3).error().message, "3 is odd");
}

TEST(CheckDeathTest, NamesTheBrokenCondition) {
  EXPECT_DEATH(TM_CHECK(1 + 1 == 3), "check failed: 1 \\+ 1 == 3");
}

TEST(SerialExecutor, CallsEachIndexOnceInOrder) {
  std::vector<std::size_t> calls;
  SerialExecutor().for_each_index(4, [&](std::size_t i) { calls.push_back(i); });
  EXPECT_EQ(calls, (std::vector<std::size_t>{0, 1, 2, 3}));
  SerialExecutor().for_each_index(0, [&](std::size_t i) { calls.push_back(i); });
  EXPECT_EQ(calls.size(), 4U);
}

}  // namespace
}  // namespace trigmesh
