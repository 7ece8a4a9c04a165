#include "drivers/camera/libcamera/device_presence.hpp"

#include <filesystem>
#include <fstream>

#include <sys/stat.h>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

TEST(DevicePresence, NoticesADeviceThatGoes) {
  const test_support::TemporaryFolder folder;
  const auto stays = folder.path() / "81:0";
  const auto goes = folder.path() / "81:1";
  std::ofstream(stays) << "a";
  std::ofstream(goes) << "b";
  const DevicePresence presence({stays.string(), goes.string()});
  EXPECT_FALSE(presence.is_lost());
  std::filesystem::remove(goes);
  EXPECT_TRUE(presence.is_lost());
}

TEST(DevicePresence, NoticesAnotherDeviceInItsPlace) {
  const test_support::TemporaryFolder folder;
  const auto path = folder.path() / "81:0";
  std::ofstream(path) << "a";
  const DevicePresence presence({path.string()});
  std::ofstream(folder.path() / "new") << "b";
  std::filesystem::rename(folder.path() / "new", path);
  EXPECT_TRUE(presence.is_lost());
}

TEST(DevicePresence, NothingIsNeverLost) {
  EXPECT_FALSE(DevicePresence().is_lost());
  EXPECT_FALSE(DevicePresence({"/sys/dev/char/no such"}).is_lost());
}

TEST(DevicePresence, FindsADeviceByItsNumber) {
  struct stat status {};

  ASSERT_EQ(::stat("/dev/null", &status), 0);
  EXPECT_FALSE(DevicePresence::of_devices({status.st_rdev}).is_lost());
}

}  // namespace
}  // namespace trigmesh
