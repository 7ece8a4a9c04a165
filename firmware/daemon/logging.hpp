#pragma once

#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "firmware/base/clock.hpp"

namespace trigmesh {

/// How much a line matters; see STYLE.
enum class LogLevel : std::uint8_t { kError, kWarn, kInfo, kDebug };

/// A name and a value: "session", "20261125T145054Z-3fa9c1". In the journal it is the field
/// TRIGMESH_SESSION, on a terminal it stands behind the text.
struct LogField {
  std::string_view name;  ///< lower case letters and '_'
  std::string value;
};

/// Where lines go.
enum class LogTarget : std::uint8_t { kStderr, kJournal };

/// The journal when the service manager has connected stderr with it, else stderr.
[[nodiscard]] LogTarget log_target();

/// Of the whole program; before the threads begin.
void set_up_logging(LogTarget target, LogLevel level);

/// Thread-safe.
void write_log(LogLevel level, std::string_view text, std::initializer_list<LogField> fields = {});

/// What does not work now, by the part of the rig: "camera", "storage", .. . Says so once when it
/// begins, once when it ends, and in between at most once in an interval. Thread-safe.
class Faults {
 public:
  /// `clock` outlives it.
  Faults(const Clock& clock, std::chrono::nanoseconds repeat_interval)
      : clock_(clock), repeat_interval_(repeat_interval) {}

  /// `message`: what was attempted, on what, why it failed.
  void report(const std::string& part, const std::string& message);

  /// The part works. Says so when it did not.
  void clear(const std::string& part);

  /// All that does not work, "camera: ..; storage: .."; empty: everything works.
  [[nodiscard]] std::string text() const;

  /// What is said of one part; empty: it works.
  [[nodiscard]] std::string text_of(const std::string& part) const;

 private:
  struct Fault {
    std::string message;
    std::chrono::nanoseconds since{};
    std::chrono::nanoseconds told{};
    std::uint64_t count = 0;
  };

  const Clock& clock_;
  const std::chrono::nanoseconds repeat_interval_;
  mutable std::mutex mutex_;
  std::map<std::string, Fault> faults_;  ///< guarded by mutex_
};

}  // namespace trigmesh
