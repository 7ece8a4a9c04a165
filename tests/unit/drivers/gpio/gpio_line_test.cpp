#include "drivers/gpio/gpio_line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

// A machine without a chip tells at least that there is none; lines that work are tested where the
// kernel has gpio-sim.
TEST(GpioLine, SaysThatThereIsNoChip) {
  const GpioSpec spec{.chip = "/dev/gpiochip-that-is-not-there", .line = "3"};
  const auto input = open_gpio_input(spec);
  ASSERT_FALSE(input);
  EXPECT_EQ(input.error().kind, FaultKind::kNotFound);
  EXPECT_THAT(input.error().message, HasSubstr("line 3 of /dev/gpiochip-that-is-not-there"));
  EXPECT_FALSE(open_gpio_output({.chip = "no-such-label", .line = "led"}));
}

TEST(GpioLine, KnowsItsLibrary) {
  EXPECT_THAT(gpio_library_version(), HasSubstr("."));
}

}  // namespace
}  // namespace trigmesh
