#include "firmware/daemon/auto_source.hpp"

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/mock/mock_source.hpp"
#include "tests/support/manual_clock.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

std::unique_ptr<MockFrameSource> camera(const Clock& clock,
                                        const std::string& name,
                                        std::vector<std::optional<FaultKind>> starts) {
  MockScript script;
  script.starts = std::move(starts);
  script.info.stable_name = name;
  return std::make_unique<MockFrameSource>(std::move(script), clock);
}

class AutoSourceTest : public ::testing::Test {
 protected:
  AutoSource two(std::vector<std::optional<FaultKind>> first,
                 std::vector<std::optional<FaultKind>> second) {
    std::vector<std::unique_ptr<FrameSource>> sources;
    sources.push_back(camera(clock_, "first", std::move(first)));
    sources.push_back(camera(clock_, "second", std::move(second)));
    return AutoSource(std::move(sources));
  }

 private:
  test_support::ManualClock clock_;
};

TEST_F(AutoSourceTest, TakesTheFirstThatAnswers) {
  AutoSource source = two({}, {});
  ASSERT_TRUE(source.start());
  EXPECT_EQ(source.info().stable_name, "first");
}

TEST_F(AutoSourceTest, GoesOnToTheNextWhenOneDoesNotAnswer) {
  AutoSource source = two({FaultKind::kNotFound}, {});
  ASSERT_TRUE(source.start());
  EXPECT_EQ(source.info().stable_name, "second");
}

TEST_F(AutoSourceTest, ChoosesAnewAtEachStart) {
  AutoSource source = two({FaultKind::kNotFound}, {});
  ASSERT_TRUE(source.start());
  source.stop();
  ASSERT_TRUE(source.start());
  EXPECT_EQ(source.info().stable_name, "first");
}

TEST_F(AutoSourceTest, TellsWhatEachAnswered) {
  AutoSource source = two({FaultKind::kNotFound}, {FaultKind::kIo});
  const DeviceResult<> started = source.start();
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().kind, FaultKind::kNotFound);
  EXPECT_THAT(started.error().message, HasSubstr("; "));
}

}  // namespace
}  // namespace trigmesh
