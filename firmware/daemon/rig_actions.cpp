// What the rig does at each action of the state machine, and what it shows of its state.
#include <utility>

#include <fmt/format.h>

#include "firmware/control/control_events.hpp"
#include "firmware/daemon/rig.hpp"
#include "firmware/daemon/rig_events.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

ErrorCode code_of(PressRefusal reason) {
  return reason == PressRefusal::kStorageFull ? ErrorCode::kNoSpace : ErrorCode::kInsufficientData;
}

}  // namespace

void Rig::advance(const RigEvent& event, nanoseconds time) {
  RigStep next = step(options_.rig, state_, event);
  state_ = next.state;
  event_time_ = time;
  for (const RigAction& action : next.actions) {
    std::visit([this](const auto& one) { act(one); }, action);
  }
}

void Rig::act(const OpenSession& /*action*/) {
  serial_ = SessionSerial{static_cast<std::uint64_t>(serial_) + 1};
  session_id_.clear();
  guide_.begin();
  told_advice_ = Advice::kNone;
  parts_.storage.push(OpenSessionOrder{serial_, continued_id_, is_pressed_});
  (void)parts_.capture.push(HoldCamera{serial_});
  for (const EdgeRecord& edge : std::exchange(recent_edges_, {})) {
    if (edge.kernel_time >= event_time_) {  // of the press that began it
      record(edge);
    }
  }
  if (asks_to_start_) {
    on_opened_ = std::exchange(asking_, nullptr);
  }
}

void Rig::act(const TakeStill& action) {
  const StillTicket ticket{next_ticket_++};
  if (asking_) {
    on_still_[ticket] = std::exchange(asking_, nullptr);
  }
  (void)parts_.capture.push(TakeStillFrame{serial_, ticket, action.time});
}

void Rig::act(const StartStreaming& /*action*/) {
  (void)parts_.capture.push(BeginStream{serial_, event_time_});
}

void Rig::act(const StopStreaming& /*action*/) {
  (void)parts_.capture.push(EndStream{serial_});
}

void Rig::act(const UndoLastFrame& /*action*/) {
  on_undone_.push_back(std::exchange(asking_, nullptr));
  parts_.storage.push(UndoOrder{serial_});
}

void Rig::act(const CloseSession& /*action*/) {
  if (!options_.rig.makes_models) {
    session_finished(session_id_);
  }
  end_session(SessionEnd::kKeep, close_reason_);
}

void Rig::act(const DiscardSession& /*action*/) {
  end_session(SessionEnd::kDiscard, {});
}

void Rig::end_session(SessionEnd end, std::string why) {
  (void)parts_.capture.push(ReleaseCamera{serial_});
  parts_.storage.push(CloseOrder{serial_, end, std::move(why)});
  if (end == SessionEnd::kDiscard) {
    session_id_.clear();
  }
}

void Rig::act(const QueueModel& /*action*/) {
  waiting_models_.push_back(std::exchange(session_id_, {}));
}

void Rig::act(const StartJob& /*action*/) {
  if (model_id_.empty()) {
    model_id_ = waiting_models_.front();
    waiting_models_.pop_front();
  }
  parts_.storage.push(BeginModelOrder{model_id_});
}

void Rig::act(const PauseJob& /*action*/) {
  parts_.storage.push(StopModelOrder{});
}

void Rig::act(const RefusePress& action) {
  answer(asking_, fail(code_of(action.reason), "cannot do that now: {}", to_string(action.reason)));
  parts_.publish(kRefusedEvent, render_refused_event(action.reason));
  write_log(LogLevel::kInfo,
            fmt::format("a press is refused: {}", to_string(action.reason)),
            {{"session", session_id_}});
  if (state_.session_open) {
    record(Note{fmt::format("a press is refused: {}", to_string(action.reason))});
  }
}

void Rig::act(const EndProgram& /*action*/) {
  has_ended_ = true;
}

void Rig::record(JournalEntry entry) {
  parts_.storage.push(RecordOrder{serial_, std::move(entry)});
}

void Rig::fail_commands(const Error& error) {
  const auto failed = [&error] { return Result<>(tl::unexpected<Error>(error)); };
  answer(asking_, failed());
  answer(on_opened_, failed());
  for (auto& [ticket, command] : std::exchange(on_still_, {})) {
    answer(command, failed());
  }
  for (auto& command : std::exchange(on_undone_, {})) {
    answer(command, failed());
  }
}

void Rig::tell_frame() {
  parts_.publish(kFrameEvent, render_frame_event(session_id_, state_.frames));
}

void Rig::show() {
  const RigPhase phase = phase_of(state_);
  if (!state_.session_open) {
    session_id_.clear();
    told_advice_ = Advice::kNone;
  }
  parts_.light.set(pattern_of(state_, last_outcome_, told_advice_));
  parts_.status.update([&](ControlStatus& status) {
    status.phase = phase;
    status.camera_present = state_.camera_present;
    status.storage = state_.storage;
    status.session_id = session_id_;
    status.frames = state_.frames;
    status.advice = told_advice_ == Advice::kNone ? "" : std::string(sentence_of(told_advice_));
    status.job = state_.job;
    status.queued_models = state_.queued;
    status.model_session_id = model_id_;
  });
  if (told_phase_ != phase || told_session_ != session_id_) {
    told_phase_ = phase;
    told_session_ = session_id_;
    parts_.publish(kPhaseEvent, render_phase_event(phase, session_id_));
  }
}

}  // namespace trigmesh
