#include "firmware/video/frame_times.hpp"

#include <chrono>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::size_t kManyFrames = 100;

const std::string kText =
    "#software: Lavf59.27.100\n"
    "#tb 0: 1/30\n"
    "#media_type 0: video\n"
    "#dimensions 0: 640x480\n"
    "0,          7,          7,        1,      472, 0x7c7119ec\n"
    "0,          8,          8,        1,      472, 0xaa50169e\n"
    "0,         11,         11,        1,      472, 0xaa50169e\r\n";

TEST(FrameTimes, CountsFromTheFirstFrame) {
  FrameTimeReader reader(kManyFrames);
  ASSERT_TRUE(reader.add(kText).has_value());
  EXPECT_THAT(reader.times(),
              ElementsAre(nanoseconds(0), nanoseconds(33333333), nanoseconds(133333333)));
}

TEST(FrameTimes, DoesNotMindHowTheTextIsCut) {
  FrameTimeReader reader(kManyFrames);
  for (const char character : kText) {
    ASSERT_TRUE(reader.add(std::string(1, character)).has_value());
  }
  EXPECT_EQ(reader.times().size(), 3U);
}

TEST(FrameTimes, WaitsForTheEndOfALine) {
  FrameTimeReader reader(kManyFrames);
  ASSERT_TRUE(reader.add("#tb 0: 1/1000000\n0, 1, 1").has_value());
  EXPECT_THAT(reader.times(), IsEmpty());
  ASSERT_TRUE(reader.add("5, 1, 1, 0x0\n").has_value());
  EXPECT_EQ(reader.times().size(), 1U);
}

TEST(FrameTimes, RefusesWhatItDoesNotUnderstand) {
  for (const char* text :
       {"0, 0, 0, 1, 1, 0x0\n",  // no time base
        "#tb 0: 1/0\n",
        "#tb 0: 30\n",
        "#tb 0: -1/30\n",
        "#tb 0: 1/30\nframe 1\n",
        "#tb 0: 1/30\n0, 0\n",
        "#tb 0: 1/30\n0, 0, NOPTS, 1, 1, 0x0\n",
        "#tb 0: 1/30\n0, 0, 99999999999999999999, 1, 1, 0x0\n",
        "#tb 0: 9/1\n0, 0, 0, 1, 1, 0x0\n0, 0, 9000000000000000000, 1, 1, 0x0\n"}) {
    FrameTimeReader reader(kManyFrames);
    const auto added = reader.add(text);
    ASSERT_FALSE(added.has_value()) << text;
    EXPECT_EQ(added.error().code, ErrorCode::kCorruptData) << text;
  }
  FrameTimeReader reader(kManyFrames);
  EXPECT_FALSE(reader.add(std::string(5000, '#')).has_value()) << "a line without end";
}

TEST(FrameTimes, KeepsTheLimitOfFrames) {
  FrameTimeReader reader(2);
  const auto added = reader.add(kText);
  ASSERT_FALSE(added.has_value());
  EXPECT_EQ(added.error().code, ErrorCode::kLimitExceeded);
  EXPECT_EQ(reader.times().size(), 2U);
}

}  // namespace
}  // namespace trigmesh
