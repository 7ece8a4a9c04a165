#include "firmware/daemon/light.hpp"

#include <algorithm>
#include <utility>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

/// How long the thread waits before it shows that it lives, and tries a light that failed again.
constexpr std::chrono::milliseconds kTurn(500);

/// While frames are captured.
IndicatorPattern pattern_of(Advice advice) {
  switch (advice) {
    case Advice::kGoBack:
      return IndicatorPattern::kLost;
    case Advice::kMoreLight:
    case Advice::kSlower:
    case Advice::kHoldSteady:
    case Advice::kStepSideways:
      return IndicatorPattern::kSlower;
    case Advice::kEnough:
    case Advice::kNone:
      break;
  }
  return IndicatorPattern::kCapturing;
}

}  // namespace

IndicatorPattern pattern_of(const RigState& state, LastOutcome outcome, Advice advice) {
  if (phase_of(state) == RigPhase::kFault) {
    return IndicatorPattern::kFailed;
  }
  if (state.storage == StorageLevel::kLow) {
    return IndicatorPattern::kStorageLow;
  }
  switch (phase_of(state)) {
    case RigPhase::kCapturing:
      return pattern_of(advice);
    case RigPhase::kWorking:
      return IndicatorPattern::kWorking;
    case RigPhase::kIdle:
    case RigPhase::kFault:
      break;
  }
  switch (outcome) {
    case LastOutcome::kDone:
      return IndicatorPattern::kDone;
    case LastOutcome::kFailed:
      return IndicatorPattern::kFailed;
    case LastOutcome::kNone:
      break;
  }
  return IndicatorPattern::kIdle;
}

void Light::set(IndicatorPattern pattern) {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(wanted_, pattern) == pattern) {
      return;
    }
    playing_ = {pattern, clock_.now(), playing_.changes + 1};
  }
  changed_.notify_all();
}

/// A pattern that is played once makes room for the one that says that the rig is ready.
void Light::go_idle(std::uint64_t changes) {
  const std::lock_guard lock(mutex_);
  if (playing_.changes == changes) {  // nothing else was asked for meanwhile
    playing_ = {IndicatorPattern::kIdle, clock_.now(), changes + 1};
  }
}

Light::Playing Light::playing() const {
  const std::lock_guard lock(mutex_);
  return playing_;
}

void Light::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    heartbeat_.beat();
    const Playing now_playing = playing();
    const nanoseconds elapsed = clock_.now() - now_playing.since;
    const auto change = next_change(now_playing.pattern, elapsed);
    if (now_playing.pattern == IndicatorPattern::kDone && !change) {
      go_idle(now_playing.changes);
      continue;
    }
    show(levels_at(now_playing.pattern, elapsed));
    const nanoseconds left = change ? *change - elapsed : nanoseconds(kTurn);
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, std::min<nanoseconds>(left, kTurn), [&] {
      return playing_.changes != now_playing.changes;
    });
  }
  show({});
}

void Light::show(const IndicatorLevels& levels) {
  if (!open_) {
    return;
  }
  if (!indicator_) {
    auto opened = open_();
    if (!opened) {
      faults_.report("light", opened.error().message);
      return;
    }
    indicator_ = *std::move(opened);
  }
  if (const auto shown = indicator_->show(levels); !shown) {
    faults_.report("light", shown.error().message);
    indicator_.reset();
    return;
  }
  faults_.clear("light");
}

}  // namespace trigmesh
