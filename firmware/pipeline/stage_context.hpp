#pragma once

#include <atomic>
#include <cstddef>
#include <stop_token>

#include "firmware/base/executor.hpp"
#include "firmware/pipeline/checkpoint.hpp"
#include "firmware/pipeline/progress.hpp"

namespace trigmesh {

/// What every stage needs besides its input. All of it outlives the stages.
struct StageContext {
  Executor& executor;
  const CheckpointFolder& checkpoints;
  ProgressListener& listener;
  const std::stop_token& stop;
};

/// Counts finished pieces of a stage from several threads and tells the listener.
class StageProgress {
 public:
  StageProgress(const StageContext& context, Stage stage, std::size_t total)
      : listener_(&context.listener), stage_(stage), total_(total) {
    listener_->on_progress({stage_, 0, total_});
  }

  void advance() { listener_->on_progress({stage_, done_.fetch_add(1) + 1, total_}); }

 private:
  ProgressListener* listener_;
  Stage stage_;
  std::size_t total_;
  std::atomic<std::size_t> done_{0};
};

}  // namespace trigmesh
