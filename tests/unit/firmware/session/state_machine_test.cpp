#include "firmware/session/state_machine.hpp"

#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr RigOptions kStill{CaptureMode::kStill, VideoTrigger::kHold, true};
constexpr RigOptions kHold{CaptureMode::kVideo, VideoTrigger::kHold, true};
constexpr RigOptions kToggle{CaptureMode::kVideo, VideoTrigger::kToggle, true};

std::string name_of(const RigAction& action) {
  static const std::vector<std::string> names = {"open",
                                                 "still",
                                                 "stream",
                                                 "stop stream",
                                                 "undo",
                                                 "close",
                                                 "discard",
                                                 "queue",
                                                 "start job",
                                                 "pause job",
                                                 "refuse",
                                                 "end"};
  std::string name = names.at(action.index());
  if (const auto* refused = std::get_if<RefusePress>(&action)) {
    name += ": " + std::string(to_string(refused->reason));
  }
  return name;
}

/// A rig that does nothing; tells the names of the actions of a step.
class Rig {
 public:
  explicit Rig(const RigOptions& options) : options_(options) {}

  std::vector<std::string> on(const RigEvent& event) {
    RigStep next = step(options_, state, event);
    state = next.state;
    std::vector<std::string> names;
    for (const RigAction& action : next.actions) {
      names.push_back(name_of(action));
    }
    return names;
  }

  RigState state;

 private:
  RigOptions options_;
};

Press press(PressKind kind) {
  return {kind, milliseconds(1)};
}

TEST(StateMachine, TakesStillsUndoesAndFinishes) {
  Rig rig(kStill);
  EXPECT_EQ(phase_of(rig.state), RigPhase::kIdle);
  EXPECT_THAT(rig.on(press(PressKind::kDown)), IsEmpty());
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("open", "still"));
  EXPECT_EQ(phase_of(rig.state), RigPhase::kCapturing);
  EXPECT_THAT(rig.on(StillStored{}), IsEmpty());
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("still"));
  EXPECT_THAT(rig.on(StillStored{}), IsEmpty());
  EXPECT_THAT(rig.on(press(PressKind::kDouble)), ElementsAre("undo"));
  EXPECT_THAT(rig.on(FrameUndone{}), IsEmpty());
  EXPECT_THAT(rig.on(press(PressKind::kLong)), ElementsAre("close", "queue", "start job"));
  EXPECT_EQ(phase_of(rig.state), RigPhase::kWorking);
  EXPECT_THAT(rig.on(JobDone{}), IsEmpty());
  EXPECT_EQ(rig.state, RigState{});
}

TEST(StateMachine, ClosesOnlyWhenEveryAwaitedFrameIsAnswered) {
  Rig rig(kStill);
  (void)rig.on(press(PressKind::kShort));
  (void)rig.on(press(PressKind::kShort));
  EXPECT_THAT(rig.on(press(PressKind::kLong)), IsEmpty());
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("refuse: closing the session"));
  EXPECT_THAT(rig.on(StillMissed{}), IsEmpty());
  EXPECT_THAT(rig.on(StillStored{}), ElementsAre("close", "queue", "start job"));
}

TEST(StateMachine, DiscardsASessionWithoutFrames) {
  Rig rig(kStill);
  (void)rig.on(press(PressKind::kShort));
  (void)rig.on(StillMissed{});
  EXPECT_THAT(rig.on(press(PressKind::kLong)), ElementsAre("discard"));
}

TEST(StateMachine, KeepsASessionThatWasContinuedForNothing) {
  Rig rig(kToggle);
  EXPECT_THAT(rig.on(StartRequest{}), ElementsAre("open", "stream"));
  EXPECT_THAT(rig.on(SessionContinued{12}), IsEmpty());
  EXPECT_EQ(rig.state.frames, 12U);
  EXPECT_THAT(rig.on(FinishRequest{}), ElementsAre("stop stream"));
  EXPECT_THAT(rig.on(StreamEnded{}), ElementsAre("close", "queue", "start job"));
}

TEST(StateMachine, StreamsWhileTheButtonIsHeld) {
  Rig rig(kHold);
  EXPECT_THAT(rig.on(press(PressKind::kDown)), ElementsAre("open", "stream"));
  EXPECT_THAT(rig.on(press(PressKind::kLong)), IsEmpty());
  EXPECT_THAT(rig.on(FrameStored{}), IsEmpty());
  EXPECT_THAT(rig.on(press(PressKind::kUp)), ElementsAre("stop stream"));
  EXPECT_THAT(rig.on(FrameStored{}), IsEmpty()) << "one was on its way";
  EXPECT_EQ(rig.state.frames, 2U);
  EXPECT_THAT(rig.on(StreamEnded{}), ElementsAre("close", "queue", "start job"));
}

TEST(StateMachine, TogglesTheStream) {
  Rig rig(kToggle);
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("open", "stream"));
  (void)rig.on(FrameStored{});
  EXPECT_THAT(rig.on(press(PressKind::kDouble)), ElementsAre("undo"));
  EXPECT_THAT(rig.on(UndoFailed{}), IsEmpty());
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("stop stream"));
  EXPECT_THAT(rig.on(StreamEnded{}), ElementsAre("close", "queue", "start job"));
}

TEST(StateMachine, ANewCapturePausesTheJobWhichGoesOnAfterIt) {
  Rig rig(kStill);
  rig.state.job = JobState::kRunning;
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("pause job", "open", "still"));
  EXPECT_THAT(rig.on(JobCancelled{}), IsEmpty());
  EXPECT_EQ(rig.state.job, JobState::kPaused);
  (void)rig.on(StillStored{});
  EXPECT_THAT(rig.on(press(PressKind::kLong)), ElementsAre("close", "queue", "start job"));
  EXPECT_EQ(rig.state.queued, 1U);
  EXPECT_THAT(rig.on(JobDone{}), ElementsAre("start job"));
  EXPECT_THAT(rig.on(JobFailed{}), IsEmpty());
  EXPECT_EQ(rig.state, RigState{});
}

TEST(StateMachine, AJobThatTheOperatorCancelsIsOver) {
  Rig rig(kStill);
  rig.state.job = JobState::kRunning;
  EXPECT_THAT(rig.on(JobCancelled{}), IsEmpty());
  EXPECT_EQ(rig.state.job, JobState::kNone);
}

TEST(StateMachine, KeepsTheSessionWhenTheCameraGoesAndStreamsOnWhenItIsBack) {
  Rig rig(kToggle);
  (void)rig.on(press(PressKind::kShort));
  (void)rig.on(FrameStored{});
  EXPECT_THAT(rig.on(CameraLost{}), ElementsAre("stop stream"));
  EXPECT_EQ(phase_of(rig.state), RigPhase::kFault);
  EXPECT_THAT(rig.on(StreamEnded{}), IsEmpty());
  EXPECT_TRUE(rig.state.session_open);
  EXPECT_THAT(rig.on(CameraBack{}), ElementsAre("stream"));
  (void)rig.on(CameraLost{});
  (void)rig.on(StreamEnded{});
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("close", "queue", "start job"));
}

TEST(StateMachine, RefusesPressesWithTheReason) {
  Rig rig(kStill);
  EXPECT_THAT(rig.on(press(PressKind::kLong)), ElementsAre("refuse: nothing to do"));
  EXPECT_THAT(rig.on(press(PressKind::kDouble)), ElementsAre("refuse: nothing to do"));
  (void)rig.on(CameraLost{});
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("refuse: no camera"));
  (void)rig.on(CameraBack{});
  (void)rig.on(StorageChanged{StorageLevel::kFull});
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("refuse: storage full"));
}

TEST(StateMachine, ClosesTheSessionBeforeTheDiskIsFull) {
  Rig rig(kHold);
  (void)rig.on(press(PressKind::kDown));
  (void)rig.on(FrameStored{});
  EXPECT_THAT(rig.on(StorageChanged{StorageLevel::kLow}), IsEmpty());
  EXPECT_THAT(rig.on(StorageChanged{StorageLevel::kFull}), ElementsAre("stop stream"));
  EXPECT_THAT(rig.on(StreamEnded{}), ElementsAre("close", "queue", "start job"));
  EXPECT_THAT(rig.on(press(PressKind::kUp)), IsEmpty());
}

TEST(StateMachine, EndsWhenEverythingIsClosed) {
  Rig rig(kStill);
  (void)rig.on(press(PressKind::kShort));
  rig.state.job = JobState::kPausing;
  EXPECT_THAT(rig.on(StopRequest{}), IsEmpty());
  EXPECT_THAT(rig.on(StillStored{}), ElementsAre("close", "queue"));
  EXPECT_THAT(rig.on(press(PressKind::kShort)), ElementsAre("refuse: stopping"));
  EXPECT_THAT(rig.on(JobCancelled{}), ElementsAre("end"));
  EXPECT_THAT(rig.on(StopRequest{}), IsEmpty());
}

/// The world of the rig, which answers what it is asked in its own time, and keeps the books.
class World {
 public:
  World(const RigOptions& options, std::uint64_t seed) : options_(options), random_(seed) {}

  /// Something happens.
  void random_event() {
    switch (random_() % 16) {
      case 0:
        apply(CameraLost{});
        break;
      case 1:
        apply(CameraBack{});
        break;
      case 2:
        apply(StorageChanged{static_cast<StorageLevel>(random_() % 3)});
        break;
      case 3:
        session_fails();
        break;
      case 4:
        apply(StartRequest{});
        break;
      case 5:
        apply(FinishRequest{});
        break;
      case 6:
        apply(StillRequest{});
        break;
      case 7:
      case 8:
      case 9:
      case 10:
        press_button(static_cast<PressKind>(random_() % 5));
        break;
      default:
        answer_something();
        break;
    }
  }

  void press_button(PressKind kind) {
    const std::size_t answers = apply(Press{kind, milliseconds(1)});
    const bool hold =
        options_.mode == CaptureMode::kVideo && options_.video_trigger == VideoTrigger::kHold;
    const bool asks =
        kind == PressKind::kShort || kind == PressKind::kLong || kind == PressKind::kDouble;
    EXPECT_TRUE(hold || !asks || answers > 0 || state_.closing) << "a press went unanswered";
  }

  /// Answers what is outstanding, or stores a frame of the stream.
  void answer_something() {
    if (stills_ > 0) {
      --stills_;
      const bool stored = random_() % 4 != 0;
      acknowledged_ += stored ? 1U : 0U;
      stored ? apply(StillStored{}) : apply(StillMissed{});
    } else if (undos_ > 0) {
      --undos_;
      const bool done = acknowledged_ > 0 && random_() % 4 != 0;
      acknowledged_ -= done ? 1U : 0U;
      done ? apply(FrameUndone{}) : apply(UndoFailed{});
    } else if (drains_ > 0) {
      if (random_() % 2 == 0) {
        ++acknowledged_;
        apply(FrameStored{});  // it was on its way
      }
      --drains_;
      apply(StreamEnded{});
    } else if (streaming_ && (!job_runs_ || random_() % 2 == 0)) {
      ++acknowledged_;
      apply(FrameStored{});
    } else if (job_asked_to_stop_) {
      job_asked_to_stop_ = false;
      job_runs_ = false;
      random_() % 4 == 0 ? apply(JobDone{}) : apply(JobCancelled{});
    } else if (job_runs_) {
      job_runs_ = false;
      random_() % 4 == 0 ? apply(JobFailed{}) : apply(JobDone{});
    }
  }

  [[nodiscard]] bool has_to_answer() const { return stills_ + undos_ + drains_ > 0 || job_runs_; }

  std::size_t apply(const RigEvent& event) {
    const RigStep next = step(options_, state_, event);
    state_ = next.state;
    for (const RigAction& action : next.actions) {
      std::visit([this](const auto& what) { do_it(what); }, action);
    }
    return next.actions.size();
  }

  void session_fails() {
    if (open_) {
      open_ = false;
      streaming_ = false;
      stills_ = 0;
      undos_ = 0;
      drains_ = 0;
      apply(SessionFailed{});
    }
  }

  [[nodiscard]] const RigState& state() const { return state_; }

  [[nodiscard]] bool is_open() const { return open_; }

  [[nodiscard]] bool streams() const { return streaming_; }

  [[nodiscard]] std::size_t ends() const { return ends_; }

 private:
  void do_it(const OpenSession&) {
    EXPECT_FALSE(open_);
    open_ = true;
    acknowledged_ = 0;
  }

  void do_it(const TakeStill&) {
    EXPECT_TRUE(open_);
    ++stills_;
  }

  void do_it(const StartStreaming&) {
    EXPECT_TRUE(open_);
    EXPECT_FALSE(streaming_);
    streaming_ = true;
  }

  void do_it(const StopStreaming&) {
    EXPECT_TRUE(streaming_);
    streaming_ = false;
    ++drains_;
  }

  void do_it(const UndoLastFrame&) { ++undos_; }

  void do_it(const CloseSession&) { end_session(); }

  void do_it(const DiscardSession&) {
    EXPECT_EQ(acknowledged_, 0U) << "acknowledged frames are thrown away";
    end_session();
  }

  void end_session() {
    EXPECT_TRUE(open_);
    EXPECT_FALSE(streaming_);
    EXPECT_EQ(stills_ + undos_ + drains_, 0U) << "closed before everything was answered";
    open_ = false;
  }

  void do_it(const QueueModel&) { ++waiting_models_; }

  void do_it(const StartJob&) {
    EXPECT_FALSE(job_runs_);
    EXPECT_FALSE(open_) << "a capture shares the machine with a job";
    job_runs_ = true;
  }

  void do_it(const PauseJob&) {
    EXPECT_TRUE(job_runs_);
    EXPECT_FALSE(job_asked_to_stop_);
    job_asked_to_stop_ = true;
  }

  void do_it(const RefusePress&) {}

  void do_it(const EndProgram&) {
    EXPECT_FALSE(open_);
    EXPECT_FALSE(job_runs_);
    ++ends_;
  }

  RigOptions options_;
  std::mt19937_64 random_;
  RigState state_;
  bool open_ = false;
  bool streaming_ = false;
  bool job_runs_ = false;
  bool job_asked_to_stop_ = false;
  std::size_t stills_ = 0;
  std::size_t undos_ = 0;
  std::size_t drains_ = 0;
  std::size_t acknowledged_ = 0;
  std::size_t waiting_models_ = 0;
  std::size_t ends_ = 0;
};

void answer_everything(World& world) {
  for (int i = 0; i < 100'000 && world.has_to_answer(); ++i) {
    world.answer_something();
  }
  ASSERT_FALSE(world.has_to_answer());
}

/// From wherever it is, the rig can capture, close, work and rest again.
void expect_no_dead_end(World& world) {
  world.apply(CameraBack{});
  world.apply(StorageChanged{StorageLevel::kOk});
  answer_everything(world);
  world.apply(FinishRequest{});
  answer_everything(world);
  ASSERT_FALSE(world.is_open());
  world.apply(StartRequest{});
  EXPECT_TRUE(world.is_open());
  EXPECT_EQ(phase_of(world.state()), RigPhase::kCapturing);
  world.apply(FinishRequest{});
  answer_everything(world);
  EXPECT_EQ(world.state(), RigState{}) << "at rest, nothing waits";
  world.apply(StopRequest{});
  answer_everything(world);
  EXPECT_EQ(world.ends(), 1U);
}

TEST(StateMachine, HasNoDeadEndAndDropsNothingWhateverHappens) {
  for (const RigOptions& options : {kStill, kHold, kToggle}) {
    for (std::uint64_t seed = 0; seed < 500 && !HasFailure(); ++seed) {
      SCOPED_TRACE(seed);
      World world(options, seed);
      for (int i = 0; i < 300; ++i) {
        world.random_event();
      }
      expect_no_dead_end(world);
    }
  }
}

TEST(StateMachine, EndsFromEverywhereWhenAskedTo) {
  for (const RigOptions& options : {kStill, kHold, kToggle}) {
    for (std::uint64_t seed = 0; seed < 200 && !HasFailure(); ++seed) {
      SCOPED_TRACE(seed);
      World world(options, seed);
      for (int i = 0; i < 50; ++i) {
        world.random_event();
      }
      world.apply(StopRequest{});
      for (int i = 0; i < 20; ++i) {
        world.random_event();
      }
      answer_everything(world);
      EXPECT_EQ(world.ends(), 1U);
    }
  }
}

}  // namespace
}  // namespace trigmesh
