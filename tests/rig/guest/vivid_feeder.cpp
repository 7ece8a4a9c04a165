// Shows raw frames on the output of a vivid device, whose capture side gets them back bit by bit.

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <iostream>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/timerfd.h>

#include <CLI/CLI.hpp>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/base/unique_fd.hpp"

namespace {

using namespace trigmesh;

constexpr std::size_t kMostFeedBytes = 256'000'000;

constexpr int kMostTries = 10;

struct Wish {
  std::string device;
  std::string feed;
  unsigned width_px = 320;
  unsigned height_px = 240;
  double rate_hz = 5.0;
  std::uint64_t count = 0;
};

volatile std::sig_atomic_t asked_to_end = 0;

/// The output of the device with its mapped buffers. One buffer stays with the driver, which goes
/// on showing it until the next comes.
class Output {
 public:
  explicit Output(const std::string& device)
      : fd_(::open(device.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK)) {}

  Result<> prepare(const Wish& wish) {
    if (!fd_.valid()) {
      return failed("open");
    }
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = wish.width_px;
    format.fmt.pix.height = wish.height_px;
    format.fmt.pix.pixelformat = V4L2_PIX_FMT_YUYV;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    TM_RETURN_IF_ERROR(call(VIDIOC_S_FMT, &format, "set the format"));
    if (format.fmt.pix.width != wish.width_px || format.fmt.pix.height != wish.height_px ||
        format.fmt.pix.bytesperline != 2 * wish.width_px) {
      return fail(ErrorCode::kUnsupported,
                  "the output takes {} x {} pixels, not {} x {}",
                  format.fmt.pix.width,
                  format.fmt.pix.height,
                  wish.width_px,
                  wish.height_px);
    }
    v4l2_requestbuffers wanted{};
    wanted.count = 3;
    wanted.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    wanted.memory = V4L2_MEMORY_MMAP;
    TM_RETURN_IF_ERROR(call(VIDIOC_REQBUFS, &wanted, "get buffers"));
    for (__u32 i = 0; i < wanted.count; ++i) {
      TM_RETURN_IF_ERROR(map(i));
      free_.push_back(i);
    }
    return {};
  }

  Result<> show(std::span<const std::uint8_t> frame) {
    TM_RETURN_IF_ERROR(take_back());
    v4l2_buffer buffer = request(free_.back());
    free_.pop_back();
    buffer.bytesused = static_cast<__u32>(frame.size());
    buffer.field = V4L2_FIELD_NONE;
    std::memcpy(buffers_[buffer.index].data(), frame.data(), frame.size());
    // A fault that was meant for the camera may meet its output instead, once.
    if (::ioctl(fd_.get(), VIDIOC_QBUF, &buffer) != 0) {
      TM_RETURN_IF_ERROR(call(VIDIOC_QBUF, &buffer, "show a frame"));
    }
    if (!is_streaming_) {
      int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
      TM_RETURN_IF_ERROR(call(VIDIOC_STREAMON, &type, "start"));
      is_streaming_ = true;
    }
    return {};
  }

 private:
  static v4l2_buffer request(__u32 index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    return buffer;
  }

  Result<> map(__u32 index) {
    v4l2_buffer buffer = request(index);
    TM_RETURN_IF_ERROR(call(VIDIOC_QUERYBUF, &buffer, "find a buffer"));
    void* memory = ::mmap(
        nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(), buffer.m.offset);
    if (memory == MAP_FAILED) {
      return failed("map a buffer");
    }
    buffers_.emplace_back(static_cast<std::uint8_t*>(memory), buffer.length);
    return {};
  }

  /// Buffers that were shown; waits for one when there is none.
  Result<> take_back() {
    while (true) {
      v4l2_buffer buffer = request(0);
      if (::ioctl(fd_.get(), VIDIOC_DQBUF, &buffer) == 0) {
        free_.push_back(buffer.index);
        continue;
      }
      if (!free_.empty()) {
        return {};
      }
      if (errno != EAGAIN) {
        return failed("take a buffer back");
      }
      pollfd entry{fd_.get(), POLLOUT, 0};
      if (::poll(&entry, 1, 10'000) <= 0 && asked_to_end == 0) {
        return fail(ErrorCode::kIo, "the output shows nothing for 10 s");
      }
      if (asked_to_end != 0) {
        return fail(ErrorCode::kCancelled, "asked to end");
      }
    }
  }

  Result<> call(unsigned long code, void* argument, const char* attempt) {
    return ::ioctl(fd_.get(), code, argument) == 0 ? Result<>() : failed(attempt);
  }

  static tl::unexpected<Error> failed(const char* attempt) {
    return fail(ErrorCode::kIo, "cannot {}: {}", attempt, std::strerror(errno));
  }

  UniqueFd fd_;
  std::vector<std::span<std::uint8_t>> buffers_;
  std::vector<__u32> free_;
  bool is_streaming_ = false;
};

Result<> feed(const Wish& wish) {
  TM_ASSIGN_OR_RETURN(const std::vector<std::uint8_t> frames,
                      read_file_bytes(wish.feed, kMostFeedBytes));
  const std::size_t frame_bytes = std::size_t{2} * wish.width_px * wish.height_px;
  if (frames.empty() || frames.size() % frame_bytes != 0) {
    return fail(ErrorCode::kInvalidArgument, "{} is not made of whole frames", wish.feed);
  }
  auto output = std::make_unique<Output>(wish.device);
  TM_RETURN_IF_ERROR(output->prepare(wish));
  const UniqueFd timer(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC));
  const auto interval = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / wish.rate_hz));
  const timespec period{interval.count() / 1'000'000'000, interval.count() % 1'000'000'000};
  const itimerspec schedule{period, period};
  if (!timer.valid() || ::timerfd_settime(timer.get(), 0, &schedule, nullptr) != 0) {
    return fail(ErrorCode::kIo, "cannot make a timer: {}", std::strerror(errno));
  }
  const std::size_t frame_count = frames.size() / frame_bytes;
  for (std::uint64_t i = 0; (wish.count == 0 || i < wish.count) && asked_to_end == 0; ++i) {
    const std::span frame = std::span(frames).subspan(i % frame_count * frame_bytes, frame_bytes);
    Result<> shown = output->show(frame);
    // Faults that tests ask of the device meet its output too, and may meet the new beginning.
    for (int tries = 0; !shown && tries < kMostTries && asked_to_end == 0; ++tries) {
      output = std::make_unique<Output>(wish.device);
      shown = output->prepare(wish);
      shown = shown ? output->show(frame) : shown;
    }
    TM_RETURN_IF_ERROR(shown);
    if (i == 0) {
      std::cout << "feeding" << std::endl;
    }
    std::uint64_t ticks = 0;
    (void)::read(timer.get(), &ticks, sizeof(ticks));
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Wish wish;
  CLI::App app(
      "Shows the YUYV frames of a file on a V4L2 output, over and over, until it is ended.");
  app.add_option("device", wish.device, "/dev/videoN")->required();
  app.add_option("feed", wish.feed, "file of raw frames")->required();
  app.add_option("--width", wish.width_px, "pixels");
  app.add_option("--height", wish.height_px, "pixels");
  app.add_option("--rate", wish.rate_hz, "frames a second")->check(CLI::Range(0.1, 100.0));
  app.add_option("--count", wish.count, "frames, then end; 0: no end");
  CLI11_PARSE(app, argc, argv);

  struct sigaction action {};

  action.sa_handler = [](int) { asked_to_end = 1; };
  (void)::sigaction(SIGTERM, &action, nullptr);
  (void)::sigaction(SIGINT, &action, nullptr);
  if (const Result<> fed = feed(wish); !fed && asked_to_end == 0) {
    std::cerr << "rig_vivid_feeder: " << fed.error().message << '\n';
    return 1;
  }
  return 0;
}
