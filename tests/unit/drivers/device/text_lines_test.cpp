#include "drivers/device/text_lines.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(LineCursor, TakesLinesOfEitherKindAndCountsThem) {
  LineCursor cursor("\xEF\xBB\xBFone\r\n\nthree");
  ASSERT_TRUE(cursor.advance());
  EXPECT_EQ(cursor.line(), "one");
  ASSERT_TRUE(cursor.advance());
  EXPECT_EQ(cursor.line(), "");
  ASSERT_TRUE(cursor.advance());
  EXPECT_EQ(cursor.line(), "three");
  EXPECT_EQ(cursor.number(), 3U);
  EXPECT_FALSE(cursor.advance());
}

TEST(WholeNumber, TakesDigitsAlone) {
  EXPECT_EQ(whole_number("0"), 0);
  EXPECT_EQ(whole_number("9223372036854775807"), 9223372036854775807);
  for (const char* text : {"", "-1", "+1", " 1", "1 ", "1.0", "0x1", "9223372036854775808"}) {
    EXPECT_FALSE(whole_number(text)) << '"' << text << '"';
  }
}

}  // namespace
}  // namespace trigmesh
