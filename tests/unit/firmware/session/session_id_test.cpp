#include "firmware/session/session_id.hpp"

#include <gtest/gtest.h>

#include "firmware/session/layout.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;

TEST(SessionId, IsTheTimeAndSixDigits) {
  EXPECT_EQ(make_session_id(seconds(1'700'000'000), 0x1003fa9c1), "20231114T221320Z-3fa9c1");
  EXPECT_EQ(make_session_id(nanoseconds(-5), 0), "19700101T000000Z-000000");
}

TEST(SessionId, KnowsItsOwnForm) {
  EXPECT_TRUE(is_session_id("20240229T235959Z-00ff00"));
  for (const char* text : {"",
                           "..",
                           "20230229T000000Z-000000",
                           "20240229T245959Z-000000",
                           "20240229T235959Z-00FF00",
                           "20240229T235959Z-00ff0",
                           "20240229T235959Z/00ff00",
                           "2024-229T235959Z-00ff00"}) {
    EXPECT_FALSE(is_session_id(text)) << text;
  }
}

TEST(SessionId, SortsBehindTheNewestWhateverTheClockSays) {
  const std::string newest = "20240229T235959Z-ffffff";
  EXPECT_EQ(next_session_id(newest, seconds(0), 1), "20240301T000000Z-000001");
  EXPECT_EQ(next_session_id("", seconds(0), 1), "19700101T000000Z-000001");
  EXPECT_EQ(next_session_id(newest, seconds(1'800'000'000), 1).substr(0, 4), "2027");
}

TEST(FrameNames, AreReadAsTheyAreWritten) {
  EXPECT_EQ(frame_file_name(123), "000123.jpg");
  EXPECT_EQ(frame_file_name(1'234'567), "1234567.jpg");
  EXPECT_EQ(frame_number_of("000123.jpg"), 123U);
  EXPECT_EQ(frame_number_of("123.jpg"), std::nullopt);
  EXPECT_EQ(frame_number_of(".000123.jpg.part"), std::nullopt);
}

}  // namespace
}  // namespace trigmesh
