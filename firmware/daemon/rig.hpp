#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/daemon/guide.hpp"
#include "firmware/daemon/heartbeat.hpp"
#include "firmware/daemon/light.hpp"
#include "firmware/daemon/logging.hpp"
#include "firmware/daemon/rig_inputs.hpp"
#include "firmware/daemon/status_board.hpp"
#include "firmware/daemon/storage_inbox.hpp"
#include "firmware/session/press_detector.hpp"
#include "firmware/session/state_machine.hpp"

namespace trigmesh {

struct RigLoopOptions {
  RigOptions rig;
  PressOptions presses;
  /// How late an edge may be heard of: the settling time of the contact, and a little. >= 0.
  std::chrono::nanoseconds edge_delay = std::chrono::milliseconds(50);
  /// A press so soon after a model is ready adds to its session; 0: each begins a new one. >= 0.
  std::chrono::nanoseconds continue_within{};
};

/// What the loop works with; all of it outlives it.
struct RigParts {
  RigQueue& inputs;
  CaptureQueue& capture;
  StorageInbox& storage;
  Light& light;
  StatusBoard& status;
  Heartbeat& heartbeat;
  const Clock& clock;
  /// Tells watchers: kind, JSON. Thread-safe.
  std::function<void(std::string_view, const std::string&)> publish;
};

/// The loop that decides: edges become presses, presses and answers become steps of the state
/// machine (firmware/session), and its actions become orders to the other threads. It waits for
/// nothing but its queue. Single thread: run() is the thread.
class Rig {
 public:
  Rig(const RigLoopOptions& options, const RigParts& parts);

  /// Until the state machine has ended the program (after EndRequest), or `stop`.
  void run(const std::stop_token& stop);

  /// Answers the commands that came too late. After run() has returned.
  void refuse_all();

 private:
  void hear(EdgeSeen& input);
  void hear(CameraChanged& input);
  void hear(SessionOpened& input);
  void hear(SessionLost& input);
  void hear(StreamFrameStored& input);
  void hear(FrameSeen& input);
  void hear(MapFollowed& input);
  void hear(StillAnswered& input);
  void hear(StreamDrained& input);
  void hear(UndoAnswered& input);
  void hear(StorageReport& input);
  void hear(ModelsWaiting& input);
  void hear(ModelAnswer& input);
  void hear(Command& input);
  void hear(EndRequest& input);

  /// A command for the state machine.
  void ask(const RigEvent& event, Command& command);
  void continue_session(Command& command);
  void cancel_model(Command& command);
  void press(const Press& press);
  /// The session that a press at `time` adds to; empty: none.
  [[nodiscard]] std::string continued_by_press(std::chrono::nanoseconds time) const;
  void presses_by_time();
  /// One step of the state machine and its actions. `time`: of what caused it.
  void advance(const RigEvent& event, std::chrono::nanoseconds time);

  void act(const OpenSession& action);
  void act(const TakeStill& action);
  void act(const StartStreaming& action);
  void act(const StopStreaming& action);
  void act(const UndoLastFrame& action);
  void act(const CloseSession& action);
  void act(const DiscardSession& action);
  void act(const QueueModel& action);
  void act(const StartJob& action);
  void act(const PauseJob& action);
  void act(const RefusePress& action);
  void act(const EndProgram& action);

  void end_session(SessionEnd end, std::string why);
  void session_finished(const std::string& id);
  void fail_commands(const Error& error);
  void answer(CommandAnswer& command, Result<> result);
  void give_answers();
  void record(JournalEntry entry);
  void show();
  void tell_frame();
  void tell_advice();
  [[nodiscard]] std::chrono::nanoseconds longest_wait() const;

  [[nodiscard]] bool is_current(SessionSerial serial) const {
    return state_.session_open && serial == serial_;
  }

  const RigLoopOptions options_;
  RigParts parts_;
  PressDetector detector_;
  RigState state_;
  std::chrono::nanoseconds event_time_{};  ///< of the event whose actions are done now
  std::chrono::nanoseconds last_down_{};
  std::string close_reason_;
  std::deque<EdgeRecord> recent_edges_;  ///< not in a journal yet: a session may begin with them

  SessionSerial serial_{};  ///< of the session that was opened last
  std::string session_id_;  ///< empty until it is open
  std::uint64_t next_ticket_ = 1;
  std::string continued_id_;  ///< of the session that is opened next; empty: a new one
  bool is_pressed_ = false;   ///< it is a press whose step is being done
  std::string finished_id_;   ///< of the session that was finished last; empty: none
  std::chrono::nanoseconds finished_time_{};
  CommandAnswer asking_;        ///< of the command whose step is being done
  bool asks_to_start_ = false;  ///< that command waits until the session is open
  CommandAnswer on_opened_;
  std::map<StillTicket, CommandAnswer> on_still_;
  std::deque<CommandAnswer> on_undone_;
  std::vector<std::pair<CommandAnswer, Result<>>> answers_;  ///< to be given

  std::deque<std::string> waiting_models_;
  std::string model_id_;  ///< at work or paused; empty: none
  bool is_model_cancelled_ = false;
  LastOutcome last_outcome_ = LastOutcome::kNone;
  std::optional<RigPhase> told_phase_;
  std::string told_session_;
  Guide guide_;
  Advice told_advice_ = Advice::kNone;
  bool has_ended_ = false;
};

}  // namespace trigmesh
