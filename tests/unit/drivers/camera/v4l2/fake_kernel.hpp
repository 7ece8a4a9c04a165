#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <linux/videodev2.h>

#include "drivers/camera/v4l2/kernel.hpp"
#include "tests/support/manual_clock.hpp"

namespace trigmesh::test_support {

/// One size of a format of the fake camera.
struct FakeSize {
  __u32 width = 0;
  __u32 height = 0;
  std::vector<v4l2_fract> intervals;
};

struct FakeFormat {
  __u32 fourcc = 0;
  std::vector<FakeSize> sizes;
};

struct FakeControl {
  int minimum = 0;
  int maximum = 0;
  int step = 1;
  int standard = 0;
  int value = 0;
  std::set<__u32> menu{};
  bool is_stuck = false;  ///< takes writes and keeps its value
};

/// A frame that the fake camera will fill in.
struct FakeFrame {
  std::vector<std::uint8_t> bytes;
  std::uint32_t sequence = 0;
  std::chrono::microseconds timestamp{0};
  __u32 flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  /// Instead of the number of bytes above, when not 0.
  __u32 claimed_bytes = 0;
};

/// A kernel that is none, with one camera at /dev/video0: keeps the books of descriptors, mappings
/// and buffers, and fails where a test says so.
class FakeKernel final : public Kernel {
 public:
  explicit FakeKernel(ManualClock& time) : time_(time) {}

  // ---- what a test sets up
  std::vector<FakeFormat> formats;
  std::map<__u32, FakeControl> controls;
  v4l2_capability capability{};
  std::map<std::string, std::string> links;  ///< path to target
  std::deque<FakeFrame> frames;              ///< to be filled in, one a buffer
  std::size_t buffer_size = 1 << 16;
  __u32 most_buffers = 32;
  __u32 bytes_per_line = 0;
  __u32 forced_fourcc = 0;
  __u32 forced_field = 0;
  bool is_plugged = true;
  bool has_inputs = false;
  __u32 input_status = 0;
  int signal_changes = 0;  ///< events that wait to be taken, once they are subscribed to
  int open_error = 0;
  int map_error = 0;
  short poll_events = 0;                ///< reported for the device when it has no frame
  std::map<unsigned long, int> errors;  ///< request to errno, for good
  /// The n-th call from now (1 is the next) of any ioctl fails with `nth_error`.
  int nth_ioctl = 0;
  int nth_error = 0;

  // ---- what a test looks at
  std::set<int> open_fds;
  std::set<const std::uint8_t*> mappings;
  std::vector<unsigned long> calls;  ///< requests of all ioctls
  std::size_t queued = 0;
  std::size_t poll_count = 0;
  bool is_streaming = false;
  bool tells_signal_changes = false;
  v4l2_fract interval{1, 30};

  [[nodiscard]] int open(const std::string& path) override;
  void close(int fd) override;
  [[nodiscard]] int ioctl(int fd, unsigned long request, void* argument) override;
  [[nodiscard]] MappedMemory map(int fd, std::size_t size, std::int64_t offset) override;
  void unmap(std::uint8_t* address, std::size_t size) override;
  [[nodiscard]] int poll(std::span<pollfd> descriptors, int timeout_ms) override;
  [[nodiscard]] std::vector<std::string> list(const std::string& folder) override;
  [[nodiscard]] std::string resolve(const std::string& path) override;

 private:
  [[nodiscard]] int answer(unsigned long request, void* argument);
  [[nodiscard]] int enumerate_format(v4l2_fmtdesc& entry) const;
  [[nodiscard]] int enumerate_size(v4l2_frmsizeenum& entry) const;
  [[nodiscard]] int enumerate_interval(v4l2_frmivalenum& entry) const;
  [[nodiscard]] const FakeFormat* find_format(__u32 fourcc) const;
  [[nodiscard]] int set_format(v4l2_format& format) const;
  [[nodiscard]] int request_buffers(v4l2_requestbuffers& request);
  [[nodiscard]] int queue(const v4l2_buffer& buffer);
  [[nodiscard]] int dequeue(v4l2_buffer& buffer);
  [[nodiscard]] int take_event(v4l2_event& event);
  [[nodiscard]] int query_control(v4l2_queryctrl& query) const;
  [[nodiscard]] int set_control(const v4l2_control& control);

  ManualClock& time_;
  int next_fd_ = 1000;
  std::vector<std::unique_ptr<std::vector<std::uint8_t>>> memory_;   // of the stream that runs
  std::vector<std::unique_ptr<std::vector<std::uint8_t>>> orphans_;  // of those before it
  std::deque<__u32> waiting_;
};

}  // namespace trigmesh::test_support
