// What a frame costs between the camera and the disk: processor time (both threads' work in one)
// and calls of operator new, for frames that are not kept and frames that are.

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/camera/slot_pool.hpp"
#include "firmware/base/check.hpp"
#include "firmware/daemon/frame_copies.hpp"
#include "firmware/daemon/frame_store.hpp"
#include "firmware/daemon/keyframe_stream.hpp"
#include "firmware/daemon/sharpest_of_group.hpp"
#include "firmware/daemon/still_shelf.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "tests/conformance/allocation_counter.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;

constexpr int kWalk = 320;  // pixels there and back, in the steps below
constexpr int kStep = 8;

enum Picture : int { kYuyv640x480, kMjpg1280x720 };

/// Squares that stand `shift_px` to the right.
cv::Mat textured(int width, int height, int channels, int shift_px) {
  cv::RNG random(3);
  cv::Mat picture(height, width, CV_8UC(channels), cv::Scalar::all(120));
  for (int i = 0; i < 3000; ++i) {
    const int x = random.uniform(-kWalk, width);
    const cv::Rect square(x + shift_px, random.uniform(0, height), 24, 24);
    const cv::Scalar colour(random.uniform(0, 255), random.uniform(0, 255), random.uniform(0, 255));
    cv::rectangle(picture, square, colour, cv::FILLED);
  }
  return picture;
}

/// A camera that gives the same frame again and again.
class Camera {
 public:
  explicit Camera(Picture picture, int shift_px = 0)
      : pool_(std::make_shared<SlotPool>(1, nullptr)) {
    if (picture == kYuyv640x480) {
      const cv::Mat pixels = textured(640, 480, 2, shift_px);
      bytes_.assign(pixels.data, pixels.data + pixels.total() * pixels.elemSize());
      info_.layout.format = PixelFormat::kYuyv;
      info_.layout.width_px = 640;
      info_.layout.height_px = 480;
      info_.layout.stride_bytes = 1280;
    } else {
      bytes_ = encode_jpeg(textured(1280, 720, 3, shift_px), 90).value();
      info_.layout.format = PixelFormat::kJpeg;
    }
    const std::size_t slot = *pool_->take();
    pool_->bytes(slot) = bytes_;
    pool_->give_back(slot);
  }

  [[nodiscard]] Frame frame() {
    const std::size_t slot = *pool_->take();
    return {info_, pool_->bytes(slot), pool_, slot};
  }

  [[nodiscard]] std::size_t size_bytes() const { return bytes_.size(); }

 private:
  std::shared_ptr<SlotPool> pool_;
  std::vector<std::uint8_t> bytes_;
  FrameInfo info_;
};

FrameTimes at(std::uint64_t sequence) {
  const std::chrono::nanoseconds time = sequence * milliseconds(33);
  return {time, time, time};
}

std::vector<Camera> camera_that_stands(Picture picture) {
  std::vector<Camera> pictures;
  pictures.emplace_back(picture);
  return pictures;
}

/// One after the other they are a walk there and back.
std::vector<Camera> camera_that_walks(Picture picture) {
  std::vector<Camera> pictures;
  for (int shift_px = 0; shift_px < 2 * kWalk; shift_px += kStep) {
    pictures.emplace_back(picture, std::min(shift_px, 2 * kWalk - shift_px));
  }
  return pictures;
}

/// What frames of one kind took.
struct Allocations {
  std::uint64_t frames = 0;
  std::uint64_t count = 0;

  void report(benchmark::State& state, const char* name) const {
    if (frames > 0 && conformance::allocations_of_this_thread()) {
      state.counters[name] = static_cast<double>(count) / static_cast<double>(frames);
    }
  }
};

/// Runs `use(frame, sequence)`, which tells whether a frame was kept, and counts.
template <typename Use>
void measure(benchmark::State& state, std::vector<Camera> pictures, Use use) {
  std::uint64_t sequence = 0;
  const auto next = [&] {
    Camera& camera = pictures[sequence % pictures.size()];
    return use(camera.frame(), sequence++);
  };
  for (int i = 0; i < 200; ++i) {  // every buffer has held a frame once
    (void)next();
  }
  Allocations kept;
  Allocations not_kept;
  for (auto _ : state) {
    const std::uint64_t before = conformance::allocations_of_this_thread().value_or(0);
    Allocations& kind = next() ? kept : not_kept;
    ++kind.frames;
    kind.count += conformance::allocations_of_this_thread().value_or(0) - before;
  }
  kept.report(state, "allocations_when_kept");
  not_kept.report(state, "allocations_when_not");
  state.counters["frame_bytes"] = static_cast<double>(pictures.front().size_bytes());
}

Picture picture_of(const benchmark::State& state) {
  return static_cast<Picture>(state.range(0));
}

/// Still mode, nobody presses: the last frames are held.
void hold_last_frames(benchmark::State& state) {
  FrameCopies copies(16);
  StillShelf shelf({.history = 8, .wait = milliseconds(2000)}, copies);
  measure(state,
          camera_that_stands(picture_of(state)),
          [&](const Frame& frame, std::uint64_t sequence) {
            TM_CHECK(shelf.offer(frame, at(sequence), sequence));
            return false;
          });
}

/// Video mode: frames are chosen; nothing is stored.
void offer_frames(benchmark::State& state, StreamSelector& selector, std::vector<Camera> pictures) {
  selector.begin({});
  StreamChoice choice;
  measure(state, std::move(pictures), [&](const Frame& frame, std::uint64_t sequence) {
    selector.offer(frame, at(sequence), sequence, choice);
    const bool is_kept = !choice.kept.empty();
    choice.kept.clear();
    choice.judged.clear();
    return is_kept;
  });
}

/// The sharpest of five is chosen.
void choose_among_frames(benchmark::State& state) {
  FrameCopies copies(16);
  SharpestOfGroup selector(5, copies);
  offer_frames(state, selector, camera_that_stands(picture_of(state)));
}

/// Keyframes: corners are followed and a verdict is given on each frame.
void select_keyframes(benchmark::State& state) {
  KeyframeOptions options;
  options.max_waiting = most_waiting_keyframes(options, milliseconds(33));
  FrameCopies copies(options.max_waiting + 2);
  KeyframeStream selector(options, copies);
  offer_frames(state, selector, camera_that_walks(picture_of(state)));
}

/// A frame that is kept: encoded if it is raw, hashed, written, fsynced, in the journal.
void store_frame(benchmark::State& state) {
  const test_support::TemporaryFolder folder(test_support::folder_in_memory());
  SteadyClock clock;
  SystemWallClock wall_clock;
  FrameStoreOptions options;
  options.store.root = folder.path();
  FrameStore store(options, {real_file_system(), clock, wall_clock});
  TM_CHECK(store.open().has_value());
  TM_CHECK(store.begin_session().has_value());
  FrameCopies copies(2);
  measure(state,
          camera_that_stands(picture_of(state)),
          [&](const Frame& frame, std::uint64_t sequence) {
            const TimedFrame timed{copies.copy(frame, sequence), at(sequence), sequence};
            TM_CHECK(store.add_frame(timed).has_value());
            return true;
          });
}

BENCHMARK(hold_last_frames)->Arg(kYuyv640x480)->Arg(kMjpg1280x720);
BENCHMARK(choose_among_frames)->Arg(kYuyv640x480)->Arg(kMjpg1280x720);
BENCHMARK(select_keyframes)->Arg(kYuyv640x480)->Arg(kMjpg1280x720);
BENCHMARK(store_frame)->Arg(kYuyv640x480)->Arg(kMjpg1280x720)->Iterations(200);

}  // namespace
}  // namespace trigmesh
