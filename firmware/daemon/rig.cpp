#include "firmware/daemon/rig.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "firmware/control/control_events.hpp"
#include "firmware/daemon/rig_events.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

/// How long the loop waits for something to happen before it shows that it lives.
constexpr std::chrono::milliseconds kTurn(500);
constexpr std::size_t kMostRecentEdges = 8;

ModelEventOutcome event_outcome(ModelOutcome outcome) {
  switch (outcome) {
    case ModelOutcome::kReady:
      return ModelEventOutcome::kReady;
    case ModelOutcome::kNone:
      return ModelEventOutcome::kNone;
    case ModelOutcome::kCancelled:
      return ModelEventOutcome::kCancelled;
    case ModelOutcome::kFailed:
      break;
  }
  return ModelEventOutcome::kFailed;
}

}  // namespace

Rig::Rig(const RigLoopOptions& options, const RigParts& parts)
    : options_(options), parts_(parts), detector_(options.presses) {
  state_.camera_present = false;  // until its first frame
}

void Rig::run(const std::stop_token& stop) {
  show();
  while (!has_ended_ && !stop.stop_requested()) {
    parts_.heartbeat.beat();
    auto input = parts_.inputs.pop(stop, longest_wait());
    presses_by_time();
    if (input) {
      std::visit([this](auto& one) { hear(one); }, *input);
    }
    show();
    give_answers();
  }
  refuse_all();
}

void Rig::refuse_all() {
  fail_commands({ErrorCode::kCancelled, "the program ends"});
  while (auto input = parts_.inputs.try_pop()) {
    if (auto* command = std::get_if<Command>(&*input)) {
      answer(command->answer, fail(ErrorCode::kCancelled, "the program ends"));
    }
  }
  give_answers();
}

void Rig::answer(CommandAnswer& command, Result<> result) {
  if (CommandAnswer given = std::exchange(command, nullptr)) {
    answers_.emplace_back(std::move(given), std::move(result));
  }
}

/// After the status was told: who is answered may look at it.
void Rig::give_answers() {
  for (auto& [command, result] : std::exchange(answers_, {})) {
    command(std::move(result));
  }
}

nanoseconds Rig::longest_wait() const {
  const auto deadline = detector_.deadline();
  if (!deadline) {
    return kTurn;
  }
  const nanoseconds left = *deadline + options_.edge_delay - parts_.clock.now();
  return std::clamp<nanoseconds>(left, std::chrono::milliseconds(1), kTurn);
}

void Rig::presses_by_time() {
  const nanoseconds certain = parts_.clock.now() - options_.edge_delay;
  if (const auto deadline = detector_.deadline(); !deadline || *deadline > certain) {
    return;
  }
  for (const Press& one : detector_.on_time(certain)) {
    press(one);
  }
}

void Rig::hear(EdgeSeen& input) {
  if (state_.session_open) {
    record(input.edge);
  } else {
    recent_edges_.push_back(input.edge);
    if (recent_edges_.size() > kMostRecentEdges) {
      recent_edges_.pop_front();
    }
  }
  for (const Press& one : detector_.on_edge(input.edge)) {
    press(one);
  }
}

void Rig::press(const Press& press) {
  const bool takes_stills = options_.rig.mode == CaptureMode::kStill;
  if (press.kind == PressKind::kDown) {
    last_down_ = press.time;
    last_outcome_ = LastOutcome::kNone;  // someone looks
    if (takes_stills) {
      (void)parts_.capture.push(ExpectPress{press.time});
    }
  }
  close_reason_ = "a press of the button";
  is_pressed_ = true;
  continued_id_ = continued_by_press(press.time);
  advance(press, press.time);
  continued_id_.clear();
  is_pressed_ = false;
  if (takes_stills && press.kind != PressKind::kDown && press.kind != PressKind::kUp) {
    const bool has_two = press.kind == PressKind::kDouble;
    (void)parts_.capture.push(ForgetPresses{has_two ? last_down_ : press.time});
  }
}

std::string Rig::continued_by_press(nanoseconds time) const {
  const bool is_soon = time - finished_time_ < options_.continue_within;
  return is_soon && !state_.session_open ? finished_id_ : std::string();
}

void Rig::session_finished(const std::string& id) {
  finished_id_ = id;
  finished_time_ = parts_.clock.now();
}

void Rig::hear(CameraChanged& input) {
  const bool is_there = input.presence == CameraPresence::kThere;
  parts_.publish(kCameraEvent, render_camera_event(input.presence));
  if (state_.session_open) {
    record(Note{is_there ? "the camera is back" : "the camera is away"});
  }
  const RigEvent event = is_there ? RigEvent(CameraBack{}) : RigEvent(CameraLost{});
  advance(event, parts_.clock.now());
}

void Rig::hear(SessionOpened& input) {
  if (is_current(input.serial)) {
    session_id_ = input.id;
    if (input.frames > 0) {
      advance(SessionContinued{input.frames}, parts_.clock.now());
    }
    answer(on_opened_, {});
  }
}

void Rig::hear(SessionLost& input) {
  if (!is_current(input.serial)) {
    return;
  }
  fail_commands(input.error);
  last_outcome_ = LastOutcome::kFailed;
  session_id_.clear();
  (void)parts_.capture.push(EndStream{input.serial});
  (void)parts_.capture.push(ReleaseCamera{input.serial});
  advance(SessionFailed{}, parts_.clock.now());
}

void Rig::hear(StreamFrameStored& input) {
  if (is_current(input.serial)) {
    advance(FrameStored{}, parts_.clock.now());
    tell_frame();
  }
}

void Rig::hear(FrameSeen& input) {
  if (is_current(input.serial)) {
    guide_.see({&input.frame, 1});
    tell_advice();
  }
}

void Rig::hear(MapFollowed& input) {
  if (!state_.session_open || input.session_id != session_id_) {
    return;  // the last frames of a capture that has ended
  }
  record(input.frame);
  guide_.follow(input);
  parts_.publish(kMapEvent, render_map_event(input));
  tell_advice();
}

void Rig::tell_advice() {
  const Advice advice = guide_.advice();
  if (advice == told_advice_) {
    return;
  }
  told_advice_ = advice;
  parts_.publish(kAdviceEvent, render_advice_event(advice));
  record(Note{fmt::format("advice: {}", sentence_of(advice))});
}

void Rig::hear(StillAnswered& input) {
  if (!is_current(input.serial)) {
    return;
  }
  if (const auto asked = on_still_.extract(input.ticket)) {
    answer(asked.mapped(), input.number.map([](std::uint32_t) {}));
  }
  if (!input.number) {
    write_log(LogLevel::kWarn,
              fmt::format("a still is missed: {}", input.number.error().message),
              {{"session", session_id_}});
    record(Note{fmt::format("a still is missed: {}", input.number.error().message)});
    advance(StillMissed{}, parts_.clock.now());
    return;
  }
  advance(StillStored{}, parts_.clock.now());
  tell_frame();
}

void Rig::hear(StreamDrained& input) {
  if (is_current(input.serial)) {
    advance(StreamEnded{}, parts_.clock.now());
  }
}

void Rig::hear(UndoAnswered& input) {
  if (!is_current(input.serial)) {
    return;
  }
  if (!on_undone_.empty()) {
    answer(on_undone_.front(), input.number.map([](std::uint32_t) {}));
    on_undone_.pop_front();
  }
  const RigEvent event = input.number ? RigEvent(FrameUndone{}) : RigEvent(UndoFailed{});
  advance(event, parts_.clock.now());
  tell_frame();
}

void Rig::hear(StorageReport& input) {
  parts_.status.update(
      [&](ControlStatus& status) { status.available_bytes = input.available_bytes; });
  if (input.level != state_.storage) {
    parts_.publish(kStorageEvent, render_storage_event(input.level, input.available_bytes));
    close_reason_ = "no space is left";
    advance(StorageChanged{input.level}, parts_.clock.now());
  }
}

void Rig::hear(ModelsWaiting& input) {
  if (!options_.rig.makes_models) {
    return;
  }
  std::uint32_t count = 0;
  for (std::string& id : input.ids) {
    const bool is_known =
        id == model_id_ ||
        std::find(waiting_models_.begin(), waiting_models_.end(), id) != waiting_models_.end();
    if (!is_known) {
      waiting_models_.push_back(std::move(id));
      ++count;
    }
  }
  std::sort(waiting_models_.begin(), waiting_models_.end());  // ids sort by age
  advance(ModelsFound{count}, parts_.clock.now());
}

void Rig::hear(ModelAnswer& input) {
  const bool is_stopped = input.outcome == ModelOutcome::kCancelled;
  const bool is_cancelled = std::exchange(is_model_cancelled_, false) && is_stopped;
  const bool is_paused = is_stopped && state_.job == JobState::kPausing && !is_cancelled;
  const bool is_failed = input.outcome == ModelOutcome::kFailed;
  write_log(is_failed ? LogLevel::kError : LogLevel::kInfo,
            fmt::format("model {}: {}", to_string(event_outcome(input.outcome)), input.message),
            {{"session", input.session_id}});
  if (!is_paused) {
    parts_.publish(
        kModelEvent,
        render_model_event({input.session_id, event_outcome(input.outcome), input.message}));
    model_id_.clear();
  }
  ModelEnd end = ModelEnd::kOver;
  if (is_stopped) {
    end = is_cancelled ? ModelEnd::kCancelled : ModelEnd::kStopped;
  }
  parts_.storage.push(ModelEndedOrder{input.session_id, end});
  if (!is_stopped) {
    last_outcome_ =
        input.outcome == ModelOutcome::kReady ? LastOutcome::kDone : LastOutcome::kFailed;
    session_finished(input.session_id);
  }
  RigEvent event = JobDone{};
  if (is_failed) {
    event = JobFailed{};
  } else if (is_paused || (is_stopped && state_.job == JobState::kRunning)) {
    event = JobCancelled{};
  }
  advance(event, parts_.clock.now());
}

void Rig::hear(Command& input) {
  last_outcome_ = LastOutcome::kNone;
  close_reason_ = "a command";
  switch (input.kind) {
    case CommandKind::kStart:
      ask(StartRequest{}, input);
      break;
    case CommandKind::kContinue:
      continue_session(input);
      break;
    case CommandKind::kFinish:
      ask(FinishRequest{}, input);
      break;
    case CommandKind::kStill:
      ask(StillRequest{input.time}, input);
      break;
    case CommandKind::kUndo:
      ask(UndoRequest{}, input);
      break;
    case CommandKind::kCancelModel:
      cancel_model(input);
      break;
  }
}

void Rig::ask(const RigEvent& event, Command& command) {
  asking_ = std::move(command.answer);
  asks_to_start_ = command.kind == CommandKind::kStart || command.kind == CommandKind::kContinue;
  advance(event, command.time);
  answer(asking_, {});  // nobody has to be waited for
}

void Rig::continue_session(Command& command) {
  const bool waits =
      std::find(waiting_models_.begin(), waiting_models_.end(), command.session_id) !=
      waiting_models_.end();
  if (state_.session_open || waits || command.session_id == model_id_) {
    answer(
        command.answer,
        fail(ErrorCode::kInsufficientData,
             "cannot continue session {} now: {}",
             command.session_id,
             state_.session_open ? "a session is open; finish it first"
                                 : "its model is being made or waits for it; cancel it, or wait"));
    return;
  }
  continued_id_ = command.session_id;
  ask(StartRequest{}, command);
  continued_id_.clear();
}

void Rig::cancel_model(Command& command) {
  if (state_.job == JobState::kNone) {
    answer(command.answer,
           fail(ErrorCode::kInsufficientData, "cannot cancel: no model is being made"));
    return;
  }
  if (state_.job == JobState::kPaused) {
    parts_.storage.push(ModelEndedOrder{model_id_, ModelEnd::kCancelled});
    parts_.publish(kModelEvent,
                   render_model_event(
                       {model_id_, ModelEventOutcome::kCancelled, "cancelled by the operator"}));
    model_id_.clear();
    advance(JobCancelled{}, parts_.clock.now());
  } else {
    is_model_cancelled_ = true;
    parts_.storage.push(StopModelOrder{});
  }
  answer(command.answer, {});
}

void Rig::hear(EndRequest& /*input*/) {
  close_reason_ = "the program ends";
  advance(StopRequest{}, parts_.clock.now());
}

}  // namespace trigmesh
