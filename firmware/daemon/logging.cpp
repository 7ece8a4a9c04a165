#include "firmware/daemon/logging.hpp"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cstdlib>
#include <vector>

#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#define SD_JOURNAL_SUPPRESS_LOCATION
#include <systemd/sd-journal.h>

namespace trigmesh {
namespace {

std::atomic<bool> goes_to_journal = false;

spdlog::level::level_enum level_of(LogLevel level) {
  switch (level) {
    case LogLevel::kError:
      return spdlog::level::err;
    case LogLevel::kWarn:
      return spdlog::level::warn;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kDebug:
      break;
  }
  return spdlog::level::debug;
}

/// The numbers of syslog.
int priority_of(LogLevel level) {
  switch (level) {
    case LogLevel::kError:
      return 3;
    case LogLevel::kWarn:
      return 4;
    case LogLevel::kInfo:
      return 6;
    case LogLevel::kDebug:
      break;
  }
  return 7;
}

std::string journal_name(std::string_view name) {
  std::string upper = "TRIGMESH_";
  std::transform(name.begin(), name.end(), std::back_inserter(upper), [](unsigned char letter) {
    return static_cast<char>(std::toupper(letter));
  });
  return upper;
}

bool send_to_journal(LogLevel level,
                     std::string_view text,
                     std::initializer_list<LogField> fields) {
  std::vector<std::string> entries = {fmt::format("MESSAGE={}", text),
                                      fmt::format("PRIORITY={}", priority_of(level)),
                                      "SYSLOG_IDENTIFIER=trigmeshd"};
  for (const LogField& field : fields) {
    entries.push_back(fmt::format("{}={}", journal_name(field.name), field.value));
  }
  std::vector<iovec> pieces;
  for (std::string& entry : entries) {
    pieces.push_back({entry.data(), entry.size()});
  }
  return sd_journal_sendv(pieces.data(), static_cast<int>(pieces.size())) == 0;
}

std::string seconds_text(std::chrono::nanoseconds time) {
  return fmt::format("{:.1f}", std::chrono::duration<double>(time).count());
}

}  // namespace

LogTarget log_target() {
  // DEVICE:INODE of the journal's stream; inherited also by programs whose stderr went elsewhere.
  const char* stream = std::getenv("JOURNAL_STREAM");

  struct stat status {};

  if (stream == nullptr || ::fstat(STDERR_FILENO, &status) != 0) {
    return LogTarget::kStderr;
  }
  return fmt::format("{}:{}", status.st_dev, status.st_ino) == stream ? LogTarget::kJournal
                                                                      : LogTarget::kStderr;
}

void set_up_logging(LogTarget target, LogLevel level) {
  auto logger = spdlog::stderr_logger_mt("trigmeshd");
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %v");
  spdlog::set_default_logger(std::move(logger));
  spdlog::set_level(level_of(level));
  goes_to_journal = target == LogTarget::kJournal;
}

void write_log(LogLevel level, std::string_view text, std::initializer_list<LogField> fields) {
  if (!spdlog::should_log(level_of(level)) ||
      (goes_to_journal && send_to_journal(level, text, fields))) {
    return;
  }
  std::string line(text);
  for (const LogField& field : fields) {
    line += fmt::format(" {}={}", field.name, field.value);
  }
  spdlog::log(level_of(level), "{}", line);
}

void Faults::report(const std::string& part, const std::string& message) {
  const std::chrono::nanoseconds now = clock_.now();
  Fault told;
  {
    const std::lock_guard lock(mutex_);
    const auto [place, is_new] = faults_.try_emplace(part, Fault{message, now, now, 0});
    Fault& fault = place->second;
    ++fault.count;
    fault.message = message;
    if (!is_new && now - fault.told < repeat_interval_) {
      return;
    }
    fault.told = now;
    told = fault;
  }
  write_log(LogLevel::kError,
            fmt::format("{}: {}", part, message),
            {{"part", part},
             {"times", std::to_string(told.count)},
             {"since_s", seconds_text(now - told.since)}});
}

void Faults::clear(const std::string& part) {
  Fault ended;
  {
    const std::lock_guard lock(mutex_);
    const auto found = faults_.find(part);
    if (found == faults_.end()) {
      return;
    }
    ended = found->second;
    faults_.erase(found);
  }
  write_log(LogLevel::kInfo,
            fmt::format("{}: works again", part),
            {{"part", part},
             {"times", std::to_string(ended.count)},
             {"lasted_s", seconds_text(clock_.now() - ended.since)}});
}

std::string Faults::text() const {
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const auto& [part, fault] : faults_) {
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", part, fault.message);
  }
  return text;
}

std::string Faults::text_of(const std::string& part) const {
  const std::lock_guard lock(mutex_);
  const auto found = faults_.find(part);
  return found == faults_.end() ? std::string() : found->second.message;
}

}  // namespace trigmesh
