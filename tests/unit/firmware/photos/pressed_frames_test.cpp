#include "firmware/photos/pressed_frames.hpp"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class PressedFrames : public ::testing::Test {
 protected:
  PressedFrames() {
    for (int i = 0; i < 10; ++i) {
      photos_.names.push_back(std::to_string(i));
      photos_.timestamps.emplace_back(100 * i);
    }
    photos_.read = [](std::size_t i) -> Result<std::vector<std::uint8_t>> {
      return std::vector<std::uint8_t>{static_cast<std::uint8_t>(i)};
    };
  }

  void write_events(const std::string& rows) {
    std::ofstream(folder_.path() / "events.csv") << "timestamp_ns,line,edge\n" << rows;
  }

  Result<PhotoSet> taken(PressMeaning meaning) {
    return frames_while_pressed(photos_, folder_.path(), meaning);
  }

  PhotoSet photos_;
  test_support::TemporaryFolder folder_;
};

TEST_F(PressedFrames, WithoutEventsAllFramesAreTaken) {
  EXPECT_THAT(taken(PressMeaning::kHold)->names, SizeIs(10));
}

TEST_F(PressedFrames, HoldEndsWithTheReleaseAndToggleWithTheNextPress) {
  write_events("150,0,falling\n430,0,rising\n700,0,falling\n720,0,rising\n");
  const auto held = taken(PressMeaning::kHold);
  ASSERT_TRUE(held) << held.error().message;
  EXPECT_THAT(held->names, ElementsAre("2", "3", "4"));
  EXPECT_THAT(held->timestamps, ElementsAre(nanoseconds(200), nanoseconds(300), nanoseconds(400)));
  EXPECT_THAT(*held->read(0), ElementsAre(2));
  EXPECT_THAT(taken(PressMeaning::kToggle)->names, ElementsAre("2", "3", "4", "5", "6", "7"));
}

TEST_F(PressedFrames, AnotherButtonEndsNothing) {
  write_events("150,0,falling\n300,1,falling\n320,1,rising\n");
  EXPECT_THAT(taken(PressMeaning::kToggle)->names, SizeIs(8)) << "to the last frame";
}

TEST_F(PressedFrames, SaysWhatIsMissing) {
  write_events("");
  EXPECT_EQ(taken(PressMeaning::kHold).error().code, ErrorCode::kInsufficientData);
  write_events("110,0,falling\n120,0,rising\n");
  const auto none = taken(PressMeaning::kHold);
  EXPECT_EQ(none.error().code, ErrorCode::kInsufficientData);
  EXPECT_THAT(none.error().message, HasSubstr("none of the 10 frames"));
  write_events("oops\n");
  EXPECT_EQ(taken(PressMeaning::kHold).error().code, ErrorCode::kCorruptData);
}

}  // namespace
}  // namespace trigmesh
