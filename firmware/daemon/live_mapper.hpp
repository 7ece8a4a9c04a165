#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/daemon/model_maker.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "firmware/pipeline/walk_follower.hpp"

namespace trigmesh {

struct LiveMapperOptions {
  /// The camera of the session's profile is added to each.
  ReconstructionOptions reconstruction;
  /// Niceness of the thread and those that it starts, [0, 19].
  int nice = 10;
  /// Frames that may wait. One more, and the mapper leaves this capture alone: the frames are on
  /// the disk, and reconstruct() does the work that is missing. > 0.
  std::size_t max_waiting = 256;
};

/// Maps captures while they go on, in a thread of its own: what it finds is told at once, and lies
/// in the session's work folder for the model that is made afterwards. Frames are read from the
/// disk, where they are for good: whatever happens here, nothing is lost. Thread-safe.
class LiveMapper {
 public:
  using OnFollowed = std::function<void(const MapFollowed& map)>;

  /// `clock` outlives it. `on_followed` comes in the mapper's thread; it may be empty.
  LiveMapper(LiveMapperOptions options, const Clock& clock, OnFollowed on_followed);
  ~LiveMapper();
  LiveMapper(const LiveMapper&) = delete;
  LiveMapper& operator=(const LiveMapper&) = delete;
  LiveMapper(LiveMapper&&) = delete;
  LiveMapper& operator=(LiveMapper&&) = delete;

  /// Returns at once.
  void follow(CaptureNews news);

  /// Waits until it has done with a capture that has ended, or was never told of, or `stop`.
  void wait_for_end(const std::string& session_id, const std::stop_token& stop);

  /// Counts up with every frame that is done.
  [[nodiscard]] std::uint64_t progress_count() const { return progress_count_; }

 private:
  struct Walk {
    CaptureBegan begin;
    std::vector<CaptureFrame> frames;
    std::unique_ptr<WalkFollower> follower;  ///< nothing: it was given up
  };

  void serve(const std::stop_token& end);
  void hear(const CaptureBegan& news);
  void hear(const CaptureFrame& news);
  void hear(const CaptureUndone& news);
  void hear(const CaptureEnded& news);
  [[nodiscard]] Result<> begin_following();
  [[nodiscard]] Result<WalkState> add(const CaptureFrame& frame);
  void give_up(const std::string& why);
  void tell(const CaptureFrame& frame, const WalkState& state, std::chrono::nanoseconds duration);
  [[nodiscard]] bool is_overrun() const;
  [[nodiscard]] std::size_t waiting_count() const;

  const LiveMapperOptions options_;
  const Clock& clock_;
  const OnFollowed on_followed_;
  std::atomic<std::uint64_t> progress_count_ = 0;
  Walk walk_;            // of the thread
  std::stop_token end_;  // of the thread
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<CaptureNews> news_;           // guarded by mutex_, as what follows
  std::size_t waiting_ = 0;                // frames in news_
  bool overrun_ = false;                   // too many waited in the capture told of last
  std::string told_id_;                    // of the capture told of last
  std::multiset<std::string> unfinished_;  // captures that are told of and not done with
  std::jthread thread_;                    // last: it uses all of the above
};

}  // namespace trigmesh
