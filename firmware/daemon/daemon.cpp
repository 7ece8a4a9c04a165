#include "firmware/daemon/daemon.hpp"

#include <utility>

#include <pthread.h>
#include <signal.h>

#include "firmware/base/check.hpp"
#include "firmware/control/control_events.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kRigInputs = 1024;
constexpr std::size_t kCaptureOrders = 256;
constexpr std::size_t kStorageOrders = 256;
constexpr std::chrono::milliseconds kProgressInterval(500);

/// A thread with a name of at most 15 letters, which hears no signals.
template <typename Work>
std::jthread named_thread(const char* name, Work work) {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);  // inherited
  std::jthread thread([name, work = std::move(work)](const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), name);
    work(stop);
  });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

void join(std::jthread& thread) {
  thread.request_stop();
  if (thread.joinable()) {
    thread.join();
  }
}

}  // namespace

Daemon::Daemon(DaemonOptions options,
               DaemonDevices devices,
               const DaemonPlace& place,
               std::function<void(std::string_view, const std::string&)> publish)
    : options_(std::move(options)),
      devices_(std::move(devices)),
      clock_(place.clock),
      publish_(std::move(publish)),
      faults_(place.clock, options_.repeat_interval),
      heartbeats_(place.clock),
      status_(options_.software_version),
      rig_queue_(kRigInputs, OverflowPolicy::kBlock),
      capture_queue_(kCaptureOrders, OverflowPolicy::kBlock),
      inbox_(options_.stream_queue_frames, kStorageOrders),
      copies_(options_.copies),
      models_(devices_.make_models(observer())),
      light_(devices_.open_light, faults_, heartbeats_.add("light"), place.clock),
      capture_(options_.capture,
               {*devices_.camera,
                copies_,
                capture_queue_,
                inbox_,
                rig_queue_,
                drops_,
                faults_,
                heartbeats_.add("camera"),
                place.clock}),
      storage_(
          options_.storage,
          {place.files, place.clock, place.wall_clock},
          {inbox_, rig_queue_, *models_, drops_, faults_, heartbeats_.add("storage"), place.clock}),
      rig_(options_.rig,
           {rig_queue_,
            capture_queue_,
            inbox_,
            light_,
            status_,
            heartbeats_.add("rig"),
            place.clock,
            publish_}),
      control_({rig_queue_,
                inbox_,
                status_,
                faults_,
                place.files,
                place.clock,
                publish_,
                devices_.list_devices},
               options_.command_patience) {
  TM_CHECK(camera_tried_.valid() && ended_.valid());
  status_.update([this](ControlStatus& status) {
    status.session_root = options_.storage.store.store.root.string();
  });
  if (devices_.trigger) {
    trigger_ = std::make_unique<TriggerReader>(TriggerParts{
        *devices_.trigger, rig_queue_, faults_, heartbeats_.add("trigger"), place.clock});
  }
}

Daemon::~Daemon() {
  stop();
}

ModelObserver Daemon::observer() {
  ModelObserver observer;
  observer.on_answer = [this](ModelAnswer answer) {
    status_.update([](ControlStatus& status) {
      status.model_stage.clear();
      status.model_done = 0;
      status.model_total = 0;
    });
    (void)rig_queue_.push(std::move(answer));
  };
  observer.on_progress = [this](const ProgressEvent& event) { tell_progress(event); };
  observer.on_followed = [this](const MapFollowed& map) { (void)rig_queue_.push(map); };
  return observer;
}

/// Comes many times a second, from several threads; watchers hear of it twice a second.
void Daemon::tell_progress(const ProgressEvent& event) {
  const std::chrono::nanoseconds now = clock_.now();
  bool is_worth_telling = false;
  status_.update([&](ControlStatus& status) {
    is_worth_telling = status.model_stage != event.stage || event.done == event.total ||
                       now - progress_told_ >= kProgressInterval;
    progress_told_ = is_worth_telling ? now : progress_told_;
    status.model_stage = event.stage;
    status.model_done = event.done;
    status.model_total = event.total;
  });
  if (is_worth_telling) {
    publish_(kProgressEvent, render_progress_event(event));
  }
}

void Daemon::start() {
  light_thread_ = named_thread("light", [this](const std::stop_token& stop) { light_.run(stop); });
  storage_thread_ = named_thread("storage", [this](const std::stop_token&) { storage_.run(); });
  rig_thread_ = named_thread("rig", [this](const std::stop_token& stop) {
    rig_.run(stop);
    ended_.set();
  });
  capture_thread_ = named_thread("camera", [this](const std::stop_token& stop) {
    capture_.run(stop, [this] { camera_tried_.set(); });
  });
  if (trigger_) {
    trigger_thread_ =
        named_thread("trigger", [this](const std::stop_token& stop) { trigger_->run(stop); });
  }
}

void Daemon::request_end() {
  (void)rig_queue_.push(EndRequest{});
}

void Daemon::stop() {
  join(trigger_thread_);
  join(capture_thread_);
  join(rig_thread_);
  rig_.refuse_all();
  inbox_.close();
  join(storage_thread_);
  join(light_thread_);
}

}  // namespace trigmesh
