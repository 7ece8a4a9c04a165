#include "drivers/camera/replay/frame_tables.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t kManyRows = 1000;

TEST(NaturalLess, OrdersDigitRunsAsNumbers) {
  std::vector<std::string> names = {
      "img10.jpg", "img2.jpg", "img1.jpg", "a.jpg", "img02.jpg", "img2b.jpg"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_THAT(names,
              ElementsAre("a.jpg", "img1.jpg", "img02.jpg", "img2.jpg", "img2b.jpg", "img10.jpg"));
}

TEST(NaturalLess, ComparesNumbersLongerThanAnyInteger) {
  EXPECT_TRUE(natural_less("99999999999999999999998.jpg", "99999999999999999999999.jpg"));
  EXPECT_TRUE(natural_less("9.jpg", "10000000000000000000000.jpg"));
}

TEST(NaturalLess, IsIrreflexiveAndPutsPrefixFirst) {
  EXPECT_FALSE(natural_less("img1.jpg", "img1.jpg"));
  EXPECT_TRUE(natural_less("img1", "img1a"));
  EXPECT_FALSE(natural_less("img1a", "img1"));
}

TEST(SafeFrameName, RefusesPathsThatLeaveTheFolder) {
  EXPECT_TRUE(is_safe_frame_name("a.jpg"));
  EXPECT_TRUE(is_safe_frame_name("left/a b.jpg"));
  EXPECT_TRUE(is_safe_frame_name("a..jpg"));
  EXPECT_FALSE(is_safe_frame_name(""));
  EXPECT_FALSE(is_safe_frame_name("/etc/passwd"));
  EXPECT_FALSE(is_safe_frame_name("../a.jpg"));
  EXPECT_FALSE(is_safe_frame_name("left/../../a.jpg"));
  EXPECT_FALSE(is_safe_frame_name("left/.."));
  EXPECT_FALSE(is_safe_frame_name(std::string("a\0b", 3)));
}

TEST(ParseTimestamps, ReadsRowsInFileOrder) {
  const auto rows = parse_timestamps("name,timestamp_ns\nb.jpg,20\n\na.jpg,10", "t.csv", kManyRows);
  ASSERT_TRUE(rows) << rows.error().message;
  EXPECT_THAT(
      *rows,
      ElementsAre(TimestampRow{"b.jpg", nanoseconds(20)}, TimestampRow{"a.jpg", nanoseconds(10)}));
}

TEST(ParseTimestamps, AcceptsWindowsLineEndsAndByteOrderMark) {
  const auto rows =
      parse_timestamps("\xEF\xBB\xBFname,timestamp_ns\r\na.jpg,7\r\n", "t.csv", kManyRows);
  ASSERT_TRUE(rows) << rows.error().message;
  EXPECT_THAT(*rows, ElementsAre(TimestampRow{"a.jpg", nanoseconds(7)}));
}

TEST(ParseTimestamps, ReadsSecondsExactlyAndIgnoresFurtherColumns) {
  const auto rows = parse_timestamps(
      "name,timestamp_s,repeated\na.jpg,1305031229.528748,0\nb.jpg,2,1\n", "t.csv", kManyRows);
  ASSERT_TRUE(rows) << rows.error().message;
  EXPECT_THAT(*rows,
              ElementsAre(TimestampRow{"a.jpg", nanoseconds(1305031229528748000)},
                          TimestampRow{"b.jpg", nanoseconds(2000000000)}));
}

struct BadTable {
  const char* text;
  const char* place;
};

class ParseTimestampsRefuses : public ::testing::TestWithParam<BadTable> {};

TEST_P(ParseTimestampsRefuses, NamingFileAndLine) {
  const auto rows = parse_timestamps(GetParam().text, "t.csv", kManyRows);
  ASSERT_FALSE(rows);
  EXPECT_EQ(rows.error().code, ErrorCode::kCorruptData);
  EXPECT_THAT(rows.error().message, HasSubstr(GetParam().place));
}

INSTANTIATE_TEST_SUITE_P(
    Tables,
    ParseTimestampsRefuses,
    ::testing::Values(BadTable{"", "t.csv:1"},
                      BadTable{"a.jpg,1\n", "t.csv:1"},
                      BadTable{"name,timestamp_ns\na.jpg\n", "t.csv:2"},
                      BadTable{"name,timestamp_ms\na.jpg,1\n", "t.csv:1"},
                      BadTable{"name,timestamp_s\na.jpg,1.0123456789\n", "t.csv:2"},
                      BadTable{"name,timestamp_s\na.jpg,1.\n", "t.csv:2"},
                      BadTable{"name,timestamp_s\na.jpg,9999999999.0\n", "t.csv:2"},
                      BadTable{"name,timestamp_ns\na.jpg,1\nb.jpg,x\n", "t.csv:3"},
                      BadTable{"name,timestamp_ns\na.jpg,-1\n", "t.csv:2"},
                      BadTable{"name,timestamp_ns\na.jpg,1.5\n", "t.csv:2"},
                      BadTable{"name,timestamp_ns\na.jpg,99999999999999999999\n", "t.csv:2"},
                      BadTable{"name,timestamp_ns\n../a.jpg,1\n", "t.csv:2"},
                      BadTable{"name,timestamp_ns\na.jpg,1\na.jpg,2\n", "t.csv:3"}));

TEST(ParseTimestamps, StopsAtTheDeclaredNumberOfRows) {
  const std::string two = "name,timestamp_ns\na.jpg,1\nb.jpg,2\n";
  EXPECT_TRUE(parse_timestamps(two, "t.csv", 2));
  const auto rows = parse_timestamps(two, "t.csv", 1);
  ASSERT_FALSE(rows);
  EXPECT_EQ(rows.error().code, ErrorCode::kLimitExceeded);
}

TEST(ParseFrameList, SkipsCommentsAndEmptyLines) {
  const auto paths = parse_frame_list("# mine\nb.jpg\n\n../other/a.png\r\n", "list.txt", kManyRows);
  ASSERT_TRUE(paths) << paths.error().message;
  EXPECT_THAT(*paths, ElementsAre("b.jpg", "../other/a.png"));
}

TEST(ParseFrameList, RefusesBinaryContentAndDuplicates) {
  const auto binary = parse_frame_list(std::string("a.jpg\n\x01\x02\n", 9), "list.txt", kManyRows);
  ASSERT_FALSE(binary);
  EXPECT_THAT(binary.error().message, HasSubstr("list.txt:2"));
  const auto twice = parse_frame_list("a.jpg\na.jpg\n", "list.txt", kManyRows);
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().message, HasSubstr("list.txt:2"));
}

}  // namespace
}  // namespace trigmesh
