#include "tests/unit/firmware/daemon/rig_under_test.hpp"

#include <poll.h>

#include "firmware/session/journal.hpp"
#include "firmware/session/layout.hpp"

namespace trigmesh::test_support {

using std::chrono::milliseconds;

RigUnderTest::RigUnderTest() {
  Settings settings;
  settings.storage.root = (temporary_.path() / "sessions").string();
  settings.capture.video_trigger = CaptureSettings::VideoTrigger::kToggle;
  settings.trigger.double_press = milliseconds(0);
  settings.trigger.debounce = milliseconds(0);
  settings.capture.every_nth_sharp_frame = 3;
  options_ = options_of_settings(settings, "", "test");
  options_.storage.check_interval = milliseconds(20);
}

void RigUnderTest::start_daemon() {
  auto button = CommandTrigger::create(clock_);
  ASSERT_TRUE(button);
  button_ = button->get();
  DaemonDevices devices;
  devices.camera = std::make_unique<LiveCamera>(camera_, clock_);
  devices.trigger = *std::move(button);
  devices.open_light = []() -> DeviceResult<std::unique_ptr<Indicator>> {
    return std::make_unique<MockIndicator>();
  };
  devices.make_models = [this](ModelObserver observer) {
    return std::make_unique<MockModelMaker>(std::move(observer), models_);
  };
  devices.list_devices = [] { return std::vector<DeviceInfo>(); };
  daemon_ = std::make_unique<Daemon>(options_,
                                     std::move(devices),
                                     DaemonPlace{disk_, clock_, wall_clock_},
                                     [this](std::string_view kind, const std::string& json) {
                                       events_.publish(std::string(kind), json);
                                     });
  daemon_->start();
}

void RigUnderTest::end_daemon() {
  if (!daemon_) {
    return;
  }
  disk_.set_stuck(false);
  camera_->is_hanging = false;
  daemon_->request_end();
  pollfd entry{daemon_->ended().fd(), POLLIN, 0};
  EXPECT_EQ(poll_until({&entry, 1}, kPatience, clock_), 1) << "it did not end";
  daemon_.reset();
}

void RigUnderTest::inject(TriggerAction action) {
  // Its thread may not have started it yet.
  await_that([&] { return button_->inject(0, action).has_value(); });
}

void RigUnderTest::press_and_release() {
  press();
  release();
}

void RigUnderTest::await(std::string_view kind, std::string_view text) {
  const auto limit = clock_.now() + kPatience;
  while (clock_.now() < limit) {
    for (const ControlEvent& event : events_.wait_after(seen_, milliseconds(100))) {
      seen_ = event.number;
      if (event.kind == kind && event.data.find(text) != std::string::npos) {
        return;
      }
    }
  }
  FAIL() << "no event " << kind << " with " << text << "; fault: " << status().fault;
}

std::vector<JournalRecord> RigUnderTest::journal_of(const std::string& id) {
  const auto scan = read_journal(disk_, temporary_.path() / "sessions" / id / kJournalName);
  EXPECT_TRUE(scan);
  return scan ? scan->records : std::vector<JournalRecord>();
}

std::vector<FrameKept> RigUnderTest::kept_of(const std::string& id) {
  std::vector<FrameKept> kept;
  for (const JournalRecord& record : journal_of(id)) {
    if (const auto* frame = std::get_if<FrameKept>(&record.entry)) {
      kept.push_back(*frame);
    }
  }
  return kept;
}

std::string RigUnderTest::leave_session(const std::vector<SessionState>& states,
                                        std::size_t frames) {
  auto store = SessionStore::open(disk_, clock_, wall_clock_, options_.storage.store.store);
  EXPECT_TRUE(store) << store.error().message;
  NewSession what;
  what.mode = "still";
  auto session = store->create(what);
  EXPECT_TRUE(session) << session.error().message;
  const std::vector<std::uint8_t> bytes(100, 1);
  for (std::size_t i = 0; i < frames; ++i) {
    EXPECT_TRUE(session->add_frame(bytes, {}));
  }
  for (const SessionState state : states) {
    EXPECT_TRUE(session->set_state(state, "before"));
  }
  return session->manifest().id;
}

}  // namespace trigmesh::test_support
