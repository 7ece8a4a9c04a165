#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "firmware/base/clock.hpp"
#include "firmware/daemon/live_mapper.hpp"
#include "firmware/daemon/model_maker.hpp"
#include "firmware/pipeline/progress.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "firmware/session/session.hpp"
#include "firmware/settings/settings.hpp"

namespace trigmesh {

struct ModelWorkerOptions {
  /// The camera of the session's profile is added to each.
  ReconstructionOptions reconstruction;
  /// Niceness of the thread and those that it starts, [0, 19].
  int nice = 10;

  [[nodiscard]] Result<> validate() const;
};

/// What the settings say about models. 0 threads: one a core.
[[nodiscard]] ModelWorkerOptions model_worker_options(const ReconstructionSettings& settings,
                                                      const ScaleSettings& scale,
                                                      const std::string& software_version);

/// Who hears of it. All but the first may be empty.
struct ModelListeners {
  /// The answer to begin(). Comes in the worker's thread, when the session was given up; the next
  /// begin() may follow inside.
  std::function<void(const ModelAnswer& answer)> on_answer;
  /// How far it is. Comes from several threads, many times a second.
  std::function<void(const std::string& session_id, const Progress& progress)> on_progress;
  /// What the map of a capture says of its frames. Comes in a thread of its own.
  std::function<void(const MapFollowed& map)> on_followed;
};

/// Makes models with the pipeline, in a thread of its own, from the kept frames of a session and
/// with its camera profile. Finished pieces lie in the session's work folder; the model is
/// published as it grows: sparse, dense, mesh, texture. The states that it sets:
///
/// - kReconstructing while it works;
/// - kModelReady: kReady. Also when only the later stages cannot be done with these pictures: the
///   message says so, what could be made is in place;
/// - kModelFailed: kNone, kFailed;
/// - what it was: kCancelled.
///
/// The same frames and options give the same bytes as `trigmesh reconstruct`, whatever the number
/// of threads and interruptions.
class ModelWorker final : public ModelMaker {
 public:
  /// `clock` outlives the worker. Precondition: `options` are valid, on_answer is there.
  ModelWorker(ModelWorkerOptions options, const Clock& clock, ModelListeners listeners);
  /// Cancels what is being made and waits for it; it is answered.
  ~ModelWorker() override;
  ModelWorker(const ModelWorker&) = delete;
  ModelWorker& operator=(const ModelWorker&) = delete;
  ModelWorker(ModelWorker&&) = delete;
  ModelWorker& operator=(ModelWorker&&) = delete;

  void begin(Session session) override;
  void request_stop() override;

  /// Captures are mapped while they go on (LiveMapper); begin() waits until that is done.
  void follow(CaptureNews news) override { live_.follow(std::move(news)); }

  [[nodiscard]] std::uint64_t progress_count() const override {
    return progress_count_ + live_.progress_count();
  }

 private:
  class Listener;

  void serve(const std::stop_token& end);
  [[nodiscard]] ModelAnswer make_model(Session session, const std::stop_token& stop);
  [[nodiscard]] Result<ReconstructionSummary> reconstruct_session(Session& session,
                                                                  const std::stop_token& stop);

  const ModelWorkerOptions options_;
  const Clock& clock_;
  const ModelListeners listeners_;
  LiveMapper live_;
  std::atomic<std::uint64_t> progress_count_ = 0;
  std::mutex mutex_;
  std::condition_variable_any job_came_;
  std::optional<Session> job_;  // guarded by mutex_
  std::stop_source job_stop_;   // guarded by mutex_: of the job that was begun last
  std::jthread thread_;         // last: it uses all of the above
};

}  // namespace trigmesh
