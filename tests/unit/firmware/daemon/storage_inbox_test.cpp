#include "firmware/daemon/storage_inbox.hpp"

#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;

StreamFrameOrder stream_frame(std::uint64_t sequence) {
  StreamFrameOrder order;
  order.frame.sequence = sequence;
  return order;
}

TEST(StorageInbox, KeepsTheOrderOfAllKinds) {
  StorageInbox inbox(4, 4);
  inbox.push(OpenSessionOrder{SessionSerial{1}});
  inbox.push(stream_frame(7));
  inbox.push(StreamDoneOrder{});
  inbox.push(StillFrameOrder{});
  EXPECT_TRUE(std::holds_alternative<OpenSessionOrder>(*inbox.pop(nanoseconds(0))));
  EXPECT_TRUE(std::holds_alternative<StreamFrameOrder>(*inbox.pop(nanoseconds(0))));
  EXPECT_TRUE(std::holds_alternative<StreamDoneOrder>(*inbox.pop(nanoseconds(0))));
  EXPECT_TRUE(std::holds_alternative<StillFrameOrder>(*inbox.pop(nanoseconds(0))));
  EXPECT_FALSE(inbox.pop(nanoseconds(0)));
}

TEST(StorageInbox, DropsTheOldestFrameOfAStreamAndNothingElse) {
  StorageInbox inbox(2, 8);
  inbox.push(UndoOrder{});
  inbox.push(stream_frame(1));
  inbox.push(StillFrameOrder{});
  inbox.push(stream_frame(2));
  inbox.push(stream_frame(3));
  EXPECT_EQ(inbox.counters().dropped_frames, 1U);
  EXPECT_EQ(inbox.counters().most_frames, 2U);
  EXPECT_TRUE(std::holds_alternative<UndoOrder>(*inbox.pop(nanoseconds(0))));
  EXPECT_TRUE(std::holds_alternative<StillFrameOrder>(*inbox.pop(nanoseconds(0))));
  EXPECT_EQ(std::get<StreamFrameOrder>(*inbox.pop(nanoseconds(0))).frame.sequence, 2U);
  EXPECT_EQ(std::get<StreamFrameOrder>(*inbox.pop(nanoseconds(0))).frame.sequence, 3U);
}

TEST(StorageInbox, OtherOrdersWaitForRoom) {
  StorageInbox inbox(2, 1);
  inbox.push(UndoOrder{});
  std::jthread giver([&] {
    for (int i = 0; i < 50; ++i) {
      inbox.push(UndoOrder{});
    }
  });
  for (int i = 0; i < 51; ++i) {
    ASSERT_TRUE(inbox.pop(seconds(30)));
  }
}

TEST(StorageInbox, GivesWhatItHasWhenItIsClosed) {
  StorageInbox inbox(2, 1);
  inbox.push(UndoOrder{});
  std::jthread giver([&] { inbox.push(UndoOrder{}); });  // may wait; the closing ends that
  inbox.close();
  giver.join();
  EXPECT_FALSE(inbox.is_finished());
  while (inbox.pop(nanoseconds(0))) {
  }
  EXPECT_TRUE(inbox.is_finished());
  inbox.push(UndoOrder{});
  EXPECT_TRUE(inbox.is_finished()) << "nothing comes into a closed one";
}

}  // namespace
}  // namespace trigmesh
