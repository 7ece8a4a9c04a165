#include "tools/trigmesh/progress_printer.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

#include <unistd.h>

#include <fmt/format.h>

namespace trigmesh {

namespace {

constexpr std::chrono::milliseconds kRedrawInterval{100};

double seconds(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double>(duration).count();
}

std::string progress_text(const Progress& progress, std::chrono::nanoseconds elapsed) {
  if (progress.total == 0) {
    return fmt::format("{:<9} ...", to_string(progress.stage));
  }
  std::string text =
      fmt::format("{:<9} {}/{}", to_string(progress.stage), progress.done, progress.total);
  const double passed = seconds(elapsed);
  if (progress.done > 0 && passed > 0.2) {
    const double rate = static_cast<double>(progress.done) / passed;
    text += fmt::format("  {:.1f}/s", rate);
    if (progress.done < progress.total) {
      text += fmt::format("  {:.0f} s left",
                          static_cast<double>(progress.total - progress.done) / rate);
    }
  }
  return text;
}

}  // namespace

ProgressPrinter::Style ProgressPrinter::style_of_stderr() {
  return isatty(STDERR_FILENO) != 0 ? Style::kTerminal : Style::kPlain;
}

ProgressPrinter::~ProgressPrinter() {
  if (style_ == Style::kTerminal && started_) {
    std::fputc('\n', stderr);
  }
}

void ProgressPrinter::on_progress(const Progress& progress) {
  if (style_ == Style::kQuiet) {
    return;
  }
  const std::lock_guard lock(mutex_);
  if (!started_ || progress.stage != stage_) {
    start_stage(progress.stage);
  }
  // Workers report in any order; the line never goes back.
  furthest_ = std::max(furthest_, progress.done);
  print({progress.stage, furthest_, progress.total}, clock_->now() - stage_start_);
}

void ProgressPrinter::start_stage(Stage stage) {
  if (style_ == Style::kTerminal && started_) {
    std::fputc('\n', stderr);
  }
  started_ = true;
  stage_ = stage;
  furthest_ = 0;
  printed_tenths_ = 0;
  stage_start_ = clock_->now();
  last_print_ = stage_start_ - kRedrawInterval;
}

void ProgressPrinter::print(const Progress& progress, std::chrono::nanoseconds elapsed) {
  const bool complete = progress.total > 0 && progress.done >= progress.total;
  if (style_ == Style::kTerminal) {
    const auto now = clock_->now();
    if (complete || now - last_print_ >= kRedrawInterval) {
      last_print_ = now;
      fmt::print(stderr, "\r\033[K{}", progress_text(progress, elapsed));
      std::fflush(stderr);
    }
    return;
  }
  const std::size_t tenths = progress.total > 0 ? 10 * progress.done / progress.total : 0;
  if (tenths > printed_tenths_) {
    printed_tenths_ = tenths;
    fmt::print(stderr, "{}\n", progress_text(progress, elapsed));
  }
}

}  // namespace trigmesh
