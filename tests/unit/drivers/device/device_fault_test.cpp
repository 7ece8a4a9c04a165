#include "drivers/device/device_fault.hpp"

#include <cerrno>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

std::vector<FaultKind> all_kinds() {
  std::vector<FaultKind> kinds;
  for (std::size_t i = 0; i < kFaultKindCount; ++i) {
    kinds.push_back(static_cast<FaultKind>(i));
  }
  return kinds;
}

TEST(DeviceFault, EachKindHasANameOfItsOwn) {
  std::set<std::string_view> names;
  for (const FaultKind kind : all_kinds()) {
    EXPECT_FALSE(to_string(kind).empty());
    names.insert(to_string(kind));
  }
  EXPECT_EQ(names.size(), kFaultKindCount);
  EXPECT_EQ(to_string(FaultKind::kNotStarted), "not started");
}

TEST(DeviceFault, TellsApartWhatTheSystemTellsApart) {
  EXPECT_EQ(fault_of_errno(ENODEV, "", "").kind, FaultKind::kDisconnected);
  EXPECT_EQ(fault_of_errno(ENOENT, "", "").kind, FaultKind::kNotFound);
  EXPECT_EQ(fault_of_errno(EACCES, "", "").kind, FaultKind::kPermission);
  EXPECT_EQ(fault_of_errno(EBUSY, "", "").kind, FaultKind::kBusy);
  EXPECT_EQ(fault_of_errno(ENOLINK, "", "").kind, FaultKind::kNoSignal);
  EXPECT_EQ(fault_of_errno(EIO, "", "").kind, FaultKind::kIo);
  EXPECT_EQ(fault_of_errno(EINVAL, "", "").kind, FaultKind::kIo);
}

TEST(DeviceFault, SaysWhatWasAttemptedOnWhat) {
  const DeviceFault fault = fault_of_errno(EBUSY, "cannot open", "/dev/video0");
  EXPECT_THAT(fault.message, HasSubstr("cannot open /dev/video0: "));
  EXPECT_EQ(to_error(fault).message, fault.message);
}

TEST(FaultPolicy, DelaysGrowAndRetriesAreBoundedOrPatient) {
  for (const FaultKind kind : all_kinds()) {
    const FaultPolicy policy = fault_policy(kind);
    EXPECT_LE(policy.first_delay, policy.longest_delay) << to_string(kind);
    EXPECT_GE(policy.max_tries, 0) << to_string(kind);
    if (policy.action == FaultAction::kRestart || policy.action == FaultAction::kReopen) {
      EXPECT_GT(policy.first_delay.count(), 0) << "busy loop on " << to_string(kind);
    }
  }
}

TEST(FaultPolicy, AnUnpluggedCameraIsWaitedForAndADamagedFrameIsPassedOver) {
  EXPECT_EQ(fault_policy(FaultKind::kDisconnected).action, FaultAction::kReopen);
  EXPECT_EQ(fault_policy(FaultKind::kDisconnected).max_tries, 0);
  EXPECT_EQ(fault_policy(FaultKind::kCorruptFrame).action, FaultAction::kContinue);
  EXPECT_EQ(fault_policy(FaultKind::kFormatRefused).action, FaultAction::kGiveUp);
}

TEST(FaultCounters, CountEachKindApart) {
  FaultCounters counters;
  counters.add(FaultKind::kGap, 3);
  counters.add(FaultKind::kTimeout);
  EXPECT_EQ(counters.of(FaultKind::kGap), 3U);
  EXPECT_EQ(counters.of(FaultKind::kTimeout), 1U);
  EXPECT_EQ(counters.of(FaultKind::kIo), 0U);
}

}  // namespace
}  // namespace trigmesh
