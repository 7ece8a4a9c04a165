#include "firmware/daemon/model_worker.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include <malloc.h>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/daemon/background_thread.hpp"
#include "firmware/daemon/session_model_place.hpp"
#include "firmware/photos/photo_input.hpp"
#include "firmware/photos/session_options.hpp"

namespace trigmesh {
namespace {

std::string times_sentence(const std::vector<StageTime>& times) {
  std::string sentence = "model made:";
  for (const StageTime& time : times) {
    sentence += fmt::format(" {} {:.1f} s",
                            to_string(time.stage),
                            std::chrono::duration<double>(time.duration).count());
  }
  return sentence;
}

/// Why the model has no scale although a length is known; or nothing.
std::string scale_sentence(const ReconstructionReport& report) {
  if (report.scale.empty() || report.scale.front().problem.empty()) {
    return {};
  }
  return fmt::format(" It has no scale: {}.", report.scale.front().problem);
}

/// Whether more is to be shot, and from where the largest gap.
std::string finish_sentence(const ReconstructionReport& report) {
  if (!report.finish) {
    return {};
  }
  const std::vector<FinishGap>& gaps = report.finish->gaps;
  return fmt::format(" {}{}",
                     report.finish->sentence,
                     gaps.empty() ? "" : fmt::format(" The largest: {}.", gaps.front().advice));
}

ModelOutcome outcome_of(const Error& error) {
  switch (error.code) {
    case ErrorCode::kCancelled:
      return ModelOutcome::kCancelled;
    case ErrorCode::kInsufficientData:
      return ModelOutcome::kNone;
    default:
      return ModelOutcome::kFailed;
  }
}

LiveMapperOptions live_options(const ModelWorkerOptions& options) {
  LiveMapperOptions live;
  live.reconstruction = options.reconstruction;
  live.nice = options.nice;
  return live;
}

/// How a finished or failed reconstruction is told. `has_model`: whether the sparse model is in
/// place.
ModelAnswer answer_of(const SessionManifest& manifest,
                      const Result<ReconstructionSummary>& made,
                      bool has_model) {
  ModelAnswer answer{manifest.id, ModelOutcome::kReady, {}};
  if (made) {
    answer.outcome = made->report.components.empty() ? ModelOutcome::kNone : ModelOutcome::kReady;
    answer.message = made->report.verdict_sentence + scale_sentence(made->report) +
                     finish_sentence(made->report);
    return answer;
  }
  answer.outcome = outcome_of(made.error());
  answer.message = made.error().message;
  if (answer.outcome == ModelOutcome::kNone && has_model) {
    answer.outcome = ModelOutcome::kReady;
    answer.message = "the model has no surface: " + made.error().message;
  }
  return answer;
}

SessionState state_of(ModelOutcome outcome, SessionState before) {
  switch (outcome) {
    case ModelOutcome::kReady:
      return SessionState::kModelReady;
    case ModelOutcome::kCancelled:
      return before;
    case ModelOutcome::kNone:
    case ModelOutcome::kFailed:
      break;
  }
  return SessionState::kModelFailed;
}

/// Makes the outcome durable. What cannot be written makes it a failure.
void settle(Session& session, SessionState before, ModelAnswer& answer) {
  const SessionState state = state_of(answer.outcome, before);
  if (const Result<> written = session.set_state(state, answer.message); !written) {
    answer.outcome = ModelOutcome::kFailed;
    answer.message = written.error().message;
    return;
  }
  if (answer.outcome != ModelOutcome::kCancelled) {
    (void)session.discard_work();  // else the next opening removes it
  }
}

}  // namespace

Result<> ModelWorkerOptions::validate() const {
  constexpr int kNicest = 19;
  TM_RETURN_IF_ERROR(reconstruction.validate());
  if (nice < 0 || nice > kNicest) {
    return fail(ErrorCode::kInvalidArgument, "nice is {}: it must be in [0, {}]", nice, kNicest);
  }
  return {};
}

ModelWorkerOptions model_worker_options(const ReconstructionSettings& settings,
                                        const ScaleSettings& scale,
                                        const std::string& software_version) {
  ModelWorkerOptions options;
  options.nice = settings.priority;
  options.reconstruction = model_options(settings, scale, software_version);
  return options;
}

/// Counts and passes on.
class ModelWorker::Listener final : public ProgressListener {
 public:
  Listener(ModelWorker& worker, std::string session_id)
      : worker_(worker), session_id_(std::move(session_id)) {}

  void on_progress(const Progress& progress) override {
    ++worker_.progress_count_;
    if (worker_.listeners_.on_progress) {
      worker_.listeners_.on_progress(session_id_, progress);
    }
  }

  void on_work() override { ++worker_.progress_count_; }

 private:
  ModelWorker& worker_;
  const std::string session_id_;
};

ModelWorker::ModelWorker(ModelWorkerOptions options, const Clock& clock, ModelListeners listeners)
    : options_(std::move(options)),
      clock_(clock),
      listeners_(std::move(listeners)),
      live_(live_options(options_), clock, listeners_.on_followed),
      thread_([this](const std::stop_token& end) { serve(end); }) {
  TM_CHECK(options_.validate().has_value());
}

ModelWorker::~ModelWorker() {
  thread_.request_stop();
  request_stop();
}

void ModelWorker::begin(Session session) {
  {
    const std::lock_guard lock(mutex_);
    TM_CHECK(!job_.has_value());
    job_ = std::move(session);
    job_stop_ = std::stop_source();
  }
  job_came_.notify_all();
}

void ModelWorker::request_stop() {
  const std::lock_guard lock(mutex_);
  job_stop_.request_stop();
}

void ModelWorker::serve(const std::stop_token& end) {
  become_background_thread("tm-model", options_.nice);
  std::unique_lock lock(mutex_);
  while (job_came_.wait(lock, end, [this] { return job_.has_value(); })) {
    Session session = *std::exchange(job_, std::nullopt);
    const std::stop_token stop = job_stop_.get_token();
    lock.unlock();
    const ModelAnswer answer = make_model(std::move(session), stop);
    // A model leaves its threads' arenas full of holes, 70 kB more each time: back to the system.
    ::malloc_trim(0);
    listeners_.on_answer(answer);
    lock.lock();
  }
}

ModelAnswer ModelWorker::make_model(Session session, const std::stop_token& stop) {
  live_.wait_for_end(session.manifest().id, stop);
  const SessionState before = session.manifest().state;
  if (const Result<> begun =
          session.set_state(SessionState::kReconstructing, "the model is being made");
      !begun) {
    return {session.manifest().id, ModelOutcome::kFailed, begun.error().message};
  }
  const Result<ReconstructionSummary> made = reconstruct_session(session, stop);
  std::error_code error;
  const bool has_model = std::filesystem::exists(session.model() / "sparse", error);
  ModelAnswer answer = answer_of(session.manifest(), made, has_model);
  if (made) {
    (void)session.record(Note{times_sentence(made->times)});  // only for people
  }
  settle(session, before, answer);
  return answer;
}

Result<ReconstructionSummary> ModelWorker::reconstruct_session(Session& session,
                                                               const std::stop_token& stop) {
  ReconstructionOptions options = options_.reconstruction;
  TM_ASSIGN_OR_RETURN(options.cameras,
                      cameras_of_profile(session.manifest().camera_profile, session.manifest().id));
  TM_ASSIGN_OR_RETURN(const PhotoSet photos,
                      open_photos(session.folder().string(), Subfolders::kIgnore, MaskUse::kUse));
  SessionModelPlace place(session);
  Listener listener(*this, session.manifest().id);
  return reconstruct(photos,
                     {place,
                      session.work_folder(),
                      /*timings=*/{},
                      ReconstructionPlaces::FinishedWork::kKeep},
                     options,
                     clock_,
                     listener,
                     stop);
}

}  // namespace trigmesh
