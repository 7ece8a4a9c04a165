#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/camera/frame_source.hpp"
#include "firmware/base/clock.hpp"
#include "firmware/daemon/camera_hold.hpp"
#include "firmware/daemon/capture_types.hpp"
#include "firmware/daemon/frame_copies.hpp"
#include "firmware/daemon/heartbeat.hpp"
#include "firmware/daemon/logging.hpp"
#include "firmware/daemon/retries.hpp"
#include "firmware/daemon/rig_inputs.hpp"
#include "firmware/daemon/still_shelf.hpp"
#include "firmware/daemon/storage_inbox.hpp"
#include "firmware/daemon/stream_selector.hpp"
#include "sfm/keyframes/keyframe_selector.hpp"

namespace trigmesh {

struct CaptureOptions {
  StillShelfOptions stills;
  std::size_t group_size = 0;  ///< of a stream, one of so many frames is kept; 0: its keyframes
  KeyframeOptions keyframes;
  /// Frames before a stream that are held, because the press is heard of late: those that were
  /// exposed after it belong to the stream.
  std::size_t pre_trigger_frames = 0;
  CameraHoldOptions hold;
  /// Between two frames, where the camera does not tell. > 0.
  std::chrono::nanoseconds frame_interval = std::chrono::milliseconds(33);
  /// A camera that gives no frame for so long is started anew. > 0.
  std::chrono::nanoseconds silence = std::chrono::seconds(2);
  /// How often held controls are compared with the camera's. > 0.
  std::chrono::nanoseconds hold_check = std::chrono::seconds(10);
};

/// What the capture thread works with; all of it outlives it.
struct CaptureParts {
  FrameSource& source;
  FrameCopies& copies;
  CaptureQueue& orders;
  StorageInbox& storage;
  RigQueue& rig;
  FrameDrops& drops;
  Faults& faults;
  Heartbeat& heartbeat;
  const Clock& clock;
};

/// The camera: runs as long as the rig is up, is started again after faults by the table of
/// fault_policy, and gives its frames to the stills and streams that were asked for. What is kept
/// goes to the storage as a copy; the camera has its buffer back before the next wait. A recording
/// begins anew at its end. Single thread: run() is the thread.
class Capture {
 public:
  Capture(const CaptureOptions& options, const CaptureParts& parts);

  /// Until `stop`. `on_first_try` is called once, when the camera was started or could not be.
  void run(const std::stop_token& stop, const std::function<void()>& on_first_try);

 private:
  enum class Ending : std::uint8_t { kStopped, kEndOfFrames, kFault };

  void start_once(const std::stop_token& stop, const std::function<void()>& on_first_try);
  [[nodiscard]] Ending take_frames(const std::stop_token& stop);
  /// Nothing: the stream goes on.
  [[nodiscard]] std::optional<Ending> use(FrameEvent event);
  [[nodiscard]] std::optional<Ending> use_fault(DeviceFault fault);
  void use_frame(const Frame& frame);
  void found_damaged(const DeviceFault& fault);

  void lose(const std::string& message);
  void found();
  void wait_to_retry(const std::stop_token& stop, std::chrono::nanoseconds delay);

  void do_orders();

  void do_order(const ExpectPress& order) { shelf_.expect(order.time); }

  void do_order(const ForgetPresses& order) { shelf_.forget(order.until); }

  void do_order(const TakeStillFrame& order) {
    shelf_.take(order.serial, order.ticket, order.time);
  }

  void do_order(const BeginStream& order);
  void do_order(const EndStream& order);
  void do_order(const HoldCamera& order);
  void do_order(const ReleaseCamera& order);

  void hand_out_stills();
  void offer_to_stream(const Frame& frame, const FrameTimes& times, std::uint64_t sequence);
  void hand_out_choice();
  void record_verdicts();
  void hold_before_press(const Frame& frame, const FrameTimes& times, std::uint64_t sequence);
  void check_hold();
  void tell(const std::vector<std::string>& sentences);
  [[nodiscard]] CameraControls* controls();
  [[nodiscard]] std::chrono::nanoseconds longest_wait() const;

  CaptureOptions options_;
  CaptureParts parts_;
  StillShelf shelf_;
  std::unique_ptr<StreamSelector> stream_;
  StreamChoice choice_;                   ///< not handed out yet
  std::vector<FrameJudged> verdicts_;     ///< not in the journal yet
  std::vector<TimedFrame> before_press_;  ///< the oldest first
  CameraHold hold_;
  Retries retries_;
  SessionSerial session_{};  ///< that began last
  bool first_try_ = true;
  bool is_running_ = false;
  bool was_found_ = false;  ///< gave a whole frame since it was started
  bool is_present_ = false;
  bool is_session_open_ = false;
  DeviceFault last_fault_;
  std::uint64_t first_sequence_ = 0;  ///< of the frames since the camera was started
  std::uint64_t next_sequence_ = 0;
  std::uint64_t damaged_in_row_ = 0;
  std::chrono::nanoseconds interval_;
  std::chrono::nanoseconds last_frame_{};
  std::chrono::nanoseconds last_hold_check_{};
};

}  // namespace trigmesh
