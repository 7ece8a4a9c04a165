#include "firmware/session/state_machine.hpp"

#include <optional>

namespace trigmesh {
namespace {

/// Applies one event; each handler changes the state and adds actions.
class Stepper {
 public:
  Stepper(const RigOptions& options, RigState state) : options_(options), state_(state) {}

  void operator()(const Press& press) {
    if (options_.mode == CaptureMode::kVideo && options_.video_trigger == VideoTrigger::kHold) {
      on_held(press);
      return;
    }
    switch (press.kind) {
      case PressKind::kShort:
        on_short(press);
        break;
      case PressKind::kLong:
        finish();
        break;
      case PressKind::kDouble:
        undo();
        break;
      case PressKind::kDown:
      case PressKind::kUp:
        break;  // only what becomes of them counts
    }
  }

  void operator()(const FrameStored&) { ++state_.frames; }

  void operator()(const StillStored&) {
    ++state_.frames;
    answer(state_.stills);
  }

  void operator()(const StillMissed&) { answer(state_.stills); }

  void operator()(const StreamEnded&) { answer(state_.drains); }

  void operator()(const FrameUndone&) {
    lower(state_.frames);
    answer(state_.undos);
  }

  void operator()(const UndoFailed&) { answer(state_.undos); }

  void operator()(const SessionFailed&) {
    state_.session_open = false;
    state_.streaming = false;
    state_.resume_streaming = false;
    state_.closing = false;
    state_.stills = 0;
    state_.drains = 0;
    state_.undos = 0;
    state_.frames = 0;
    after_capture();
  }

  void operator()(const CameraLost&) {
    state_.camera_present = false;
    if (state_.streaming) {
      stop_streaming();
      state_.resume_streaming = true;
    }
  }

  void operator()(const CameraBack&) {
    state_.camera_present = true;
    if (state_.resume_streaming) {
      state_.resume_streaming = false;
      start_streaming();
    }
  }

  void operator()(const StorageChanged& event) {
    state_.storage = event.level;
    if (event.level == StorageLevel::kFull && state_.session_open) {
      close();
    }
  }

  void operator()(const JobDone&) { end_job(); }

  void operator()(const JobFailed&) { end_job(); }

  void operator()(const JobCancelled&) {
    state_.job = state_.job == JobState::kPausing ? JobState::kPaused : JobState::kNone;
    after_capture();
  }

  void operator()(const ModelsFound& found) {
    if (options_.makes_models) {
      state_.queued += found.count;
      after_capture();
    }
  }

  void operator()(const SessionContinued& event) { state_.frames += event.frames; }

  void operator()(const StartRequest&) {
    if (const auto reason = why_not_capture()) {
      refuse(*reason);
      return;
    }
    open_if_needed();
    if (options_.mode == CaptureMode::kVideo && !state_.streaming) {
      start_streaming();
    }
  }

  void operator()(const FinishRequest&) { finish(); }

  void operator()(const StillRequest& request) { take_still(request.time); }

  void operator()(const UndoRequest&) { undo(); }

  void operator()(const StopRequest&) {
    state_.stopping = true;
    if (state_.session_open) {
      close();
    } else {
      after_capture();
    }
  }

  [[nodiscard]] RigStep result() && { return {state_, std::move(actions_)}; }

 private:
  template <typename Action>
  void act(Action action) {
    actions_.emplace_back(std::move(action));
  }

  void refuse(PressRefusal reason) { act(RefusePress{reason}); }

  [[nodiscard]] std::optional<PressRefusal> why_not_capture() const {
    if (state_.stopping) {
      return PressRefusal::kStopping;
    }
    if (!state_.camera_present) {
      return PressRefusal::kNoCamera;
    }
    if (state_.storage == StorageLevel::kFull) {
      return PressRefusal::kStorageFull;
    }
    return state_.closing ? std::optional(PressRefusal::kClosing) : std::nullopt;
  }

  void on_held(const Press& press) {
    if (press.kind == PressKind::kDown) {
      (*this)(StartRequest{});
    } else if (press.kind == PressKind::kUp && state_.session_open && !state_.closing) {
      close();
    }
  }

  void on_short(const Press& press) {
    if (options_.mode == CaptureMode::kStill) {
      take_still(press.time);
    } else if (state_.streaming || state_.resume_streaming) {
      close();
    } else {
      (*this)(StartRequest{});
    }
  }

  void take_still(std::chrono::nanoseconds time) {
    if (const auto reason = why_not_capture()) {
      refuse(*reason);
      return;
    }
    open_if_needed();
    ++state_.stills;
    act(TakeStill{time});
  }

  void undo() {
    if (!state_.session_open || state_.closing || state_.frames <= state_.undos) {
      refuse(state_.closing ? PressRefusal::kClosing : PressRefusal::kNothingToDo);
      return;
    }
    ++state_.undos;
    act(UndoLastFrame{});
  }

  void finish() {
    if (!state_.session_open || state_.closing) {
      refuse(state_.closing ? PressRefusal::kClosing : PressRefusal::kNothingToDo);
      return;
    }
    close();
  }

  void open_if_needed() {
    if (state_.session_open) {
      return;
    }
    if (state_.job == JobState::kRunning) {
      state_.job = JobState::kPausing;
      act(PauseJob{});
    }
    state_.session_open = true;
    state_.frames = 0;
    act(OpenSession{});
  }

  void start_streaming() {
    state_.streaming = true;
    act(StartStreaming{});
  }

  void stop_streaming() {
    state_.streaming = false;
    ++state_.drains;
    act(StopStreaming{});
  }

  static void lower(std::uint32_t& count) { count -= count > 0 ? 1 : 0; }

  void answer(std::uint32_t& awaited) {
    lower(awaited);
    close_when_answered();
  }

  void close() {
    if (state_.streaming) {
      stop_streaming();
    }
    state_.resume_streaming = false;
    state_.closing = true;
    close_when_answered();
  }

  void close_when_answered() {
    if (!state_.closing || state_.stills + state_.drains + state_.undos > 0) {
      return;
    }
    state_.closing = false;
    state_.session_open = false;
    if (state_.frames == 0) {
      act(DiscardSession{});
    } else {
      act(CloseSession{});
      if (options_.makes_models) {
        ++state_.queued;
        act(QueueModel{});
      }
    }
    state_.frames = 0;
    after_capture();
  }

  void end_job() {
    state_.job = JobState::kNone;
    after_capture();
  }

  /// What the machine does when nothing is captured: the job, or the end.
  void after_capture() {
    if (state_.session_open) {
      return;
    }
    if (state_.stopping) {
      stop_job_or_end();
    } else if (state_.job == JobState::kPaused) {
      state_.job = JobState::kRunning;
      act(StartJob{});
    } else if (state_.job == JobState::kNone && state_.queued > 0) {
      --state_.queued;
      state_.job = JobState::kRunning;
      act(StartJob{});
    }
  }

  void stop_job_or_end() {
    if (state_.job == JobState::kRunning) {
      state_.job = JobState::kPausing;
      act(PauseJob{});
    } else if (state_.job != JobState::kPausing && !state_.ended) {
      state_.ended = true;
      act(EndProgram{});
    }
  }

  const RigOptions& options_;
  RigState state_;
  std::vector<RigAction> actions_;
};

}  // namespace

RigPhase phase_of(const RigState& state) {
  if (!state.camera_present || state.storage == StorageLevel::kFull) {
    return RigPhase::kFault;
  }
  if (state.session_open) {
    return RigPhase::kCapturing;
  }
  return state.job == JobState::kNone ? RigPhase::kIdle : RigPhase::kWorking;
}

std::string_view to_string(PressRefusal reason) {
  switch (reason) {
    case PressRefusal::kNoCamera:
      return "no camera";
    case PressRefusal::kStorageFull:
      return "storage full";
    case PressRefusal::kStopping:
      return "stopping";
    case PressRefusal::kClosing:
      return "closing the session";
    case PressRefusal::kNothingToDo:
      return "nothing to do";
  }
  return "unknown";
}

RigStep step(const RigOptions& options, RigState state, const RigEvent& event) {
  Stepper stepper(options, state);
  std::visit(stepper, event);
  return std::move(stepper).result();
}

}  // namespace trigmesh
