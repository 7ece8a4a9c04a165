#include "drivers/camera/libcamera/mapped_planes.hpp"

#include <numeric>
#include <optional>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/camera/libcamera/memory_file.hpp"

namespace trigmesh {
namespace {

using test_support::MemoryFile;
using ::testing::HasSubstr;

std::vector<std::uint8_t> counted(std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

TEST(MappedPlanes, BeginsAtTheOffsetOfThePlane) {
  std::optional<MemoryFile> file(std::in_place, counted(100));
  const PlanePlace planes[] = {{file->fd(), 10, 20}};
  auto mapped = MappedPlanes::map(planes, 20, "front");
  ASSERT_TRUE(mapped) << mapped.error().message;
  file.reset();
  ASSERT_EQ(mapped->bytes().size(), 20U) << "the memory stays when its descriptor is closed";
  EXPECT_EQ(mapped->bytes()[0], 10);
  EXPECT_EQ(mapped->bytes()[19], 29);
  mapped->begin_reading();
  mapped->end_reading();
  const MappedPlanes moved = *std::move(mapped);
  EXPECT_EQ(moved.bytes()[0], 10);
}

TEST(MappedPlanes, JoinsPlanesThatFollowOneAnother) {
  const MemoryFile file(counted(100));
  const PlanePlace planes[] = {{file.fd(), 0, 40}, {file.fd(), 40, 20}};
  const auto mapped = MappedPlanes::map(planes, 40, "front");
  ASSERT_TRUE(mapped) << mapped.error().message;
  EXPECT_EQ(mapped->bytes().size(), 60U);
  EXPECT_EQ(mapped->bytes()[59], 59);
}

TEST(MappedPlanes, RefusesPlanesThatDoNot) {
  const MemoryFile file(counted(100));
  const MemoryFile other(counted(100));
  const PlanePlace apart[] = {{file.fd(), 0, 40}, {file.fd(), 48, 20}};
  const auto refused = MappedPlanes::map(apart, 40, "front");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, FaultKind::kFormatRefused);
  EXPECT_THAT(refused.error().message, HasSubstr("choose a format with one plane"));
  const PlanePlace elsewhere[] = {{file.fd(), 0, 40}, {other.fd(), 40, 20}};
  EXPECT_EQ(MappedPlanes::map(elsewhere, 40, "front").error().kind, FaultKind::kFormatRefused);
}

TEST(MappedPlanes, SaysThatADescriptorCannotBeMapped) {
  const PlanePlace planes[] = {{-1, 0, 40}};
  EXPECT_THAT(MappedPlanes::map(planes, 40, "front").error().message, HasSubstr("front"));
}

}  // namespace
}  // namespace trigmesh
