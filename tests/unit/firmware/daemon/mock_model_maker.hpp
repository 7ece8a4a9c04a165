#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/daemon/daemon.hpp"

namespace trigmesh::test_support {

/// What a MockModelMaker was asked, and how it ends. Thread-safe.
class ModelScript {
 public:
  /// Ends the model that is at work; nothing when there is none. kReady and so on.
  void finish(ModelOutcome outcome) {
    std::optional<Session> session;
    std::function<void(ModelAnswer)> answer;
    {
      const std::lock_guard lock(mutex_);
      session = std::exchange(session_, std::nullopt);
      answer = answer_;
    }
    if (!session) {
      return;
    }
    const std::string id = session->manifest().id;
    settle(*session, outcome);
    session.reset();  // given up before the answer
    answer({id, outcome, "as the test says"});
  }

  /// The program ends at once.
  void lose() {
    const std::lock_guard lock(mutex_);
    session_.reset();
  }

  [[nodiscard]] std::vector<std::string> begun() const {
    const std::lock_guard lock(mutex_);
    return begun_;
  }

  /// What was told of captures: "began", "frame 1", "undone", "ended".
  [[nodiscard]] std::vector<std::string> news() const {
    const std::lock_guard lock(mutex_);
    return news_;
  }

  /// Tells the rig how a frame of its open session was mapped.
  void tell(MapFollowed map) {
    std::function<void(const MapFollowed&)> on_followed;
    {
      const std::lock_guard lock(mutex_);
      map.session_id = capture_id_;
      on_followed = on_followed_;
    }
    on_followed(map);
  }

  std::atomic<std::uint64_t> progress = 0;

 private:
  friend class MockModelMaker;

  void settle(Session& session, ModelOutcome outcome) {
    if (outcome == ModelOutcome::kCancelled) {
      (void)session.set_state(before_, "cancelled");
    } else {
      const bool is_ready = outcome == ModelOutcome::kReady;
      (void)session.set_state(is_ready ? SessionState::kModelReady : SessionState::kModelFailed,
                              "as the test says");
    }
  }

  mutable std::mutex mutex_;
  std::optional<Session> session_;  ///< guarded by mutex_, as what follows
  SessionState before_ = SessionState::kClosed;
  std::function<void(ModelAnswer)> answer_;
  std::function<void(const MapFollowed&)> on_followed_;
  std::vector<std::string> begun_;
  std::string capture_id_;
  std::vector<std::string> news_;
};

/// A maker of models that makes none: it ends when the test or a stop says so.
class MockModelMaker final : public ModelMaker {
 public:
  MockModelMaker(ModelObserver observer, ModelScript& script) : script_(script) {
    const std::lock_guard lock(script_.mutex_);
    script_.answer_ = std::move(observer.on_answer);
    script_.on_followed_ = std::move(observer.on_followed);
  }

  void begin(Session session) override {
    const std::lock_guard lock(script_.mutex_);
    script_.before_ = session.manifest().state;
    script_.begun_.push_back(session.manifest().id);
    (void)session.set_state(SessionState::kReconstructing, "begun");
    script_.session_.emplace(std::move(session));
  }

  void follow(CaptureNews news) override {
    const std::lock_guard lock(script_.mutex_);
    if (const auto* begin = std::get_if<CaptureBegan>(&news)) {
      script_.capture_id_ = begin->session_id;
      script_.news_.emplace_back("began");
    } else if (const auto* frame = std::get_if<CaptureFrame>(&news)) {
      script_.news_.push_back("frame " + std::to_string(frame->number));
    } else {
      script_.news_.emplace_back(std::holds_alternative<CaptureUndone>(news) ? "undone" : "ended");
    }
  }

  void request_stop() override { script_.finish(ModelOutcome::kCancelled); }

  [[nodiscard]] std::uint64_t progress_count() const override { return script_.progress; }

 private:
  ModelScript& script_;
};

}  // namespace trigmesh::test_support
