#pragma once

#include <chrono>
#include <mutex>

#include "firmware/base/clock.hpp"
#include "firmware/pipeline/progress.hpp"

namespace trigmesh {

/// Shows the progress of a reconstruction on stderr: one line that is rewritten on a terminal;
/// otherwise plain lines, one per tenth of a stage. Stage, pieces done, rate and time left.
class ProgressPrinter final : public ProgressListener {
 public:
  enum class Style { kTerminal, kPlain, kQuiet };

  /// `clock` outlives the printer.
  ProgressPrinter(Style style, const Clock& clock) : style_(style), clock_(&clock) {}

  ~ProgressPrinter() override;
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;
  ProgressPrinter(ProgressPrinter&&) = delete;
  ProgressPrinter& operator=(ProgressPrinter&&) = delete;

  /// kTerminal when stderr is a terminal, else kPlain.
  [[nodiscard]] static Style style_of_stderr();

  void on_progress(const Progress& progress) override;

 private:
  void start_stage(Stage stage);
  void print(const Progress& progress, std::chrono::nanoseconds elapsed);

  Style style_;
  const Clock* clock_;
  std::mutex mutex_;
  bool started_ = false;
  Stage stage_ = Stage::kExtract;
  std::size_t furthest_ = 0;
  std::size_t printed_tenths_ = 0;
  std::chrono::nanoseconds stage_start_{};
  std::chrono::nanoseconds last_print_{};
};

}  // namespace trigmesh
