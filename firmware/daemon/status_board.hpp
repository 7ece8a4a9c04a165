#pragma once

#include <mutex>
#include <string>

#include "firmware/control/control_events.hpp"
#include "firmware/control/control_target.hpp"

namespace trigmesh {

/// What the rig says about itself, written by its threads and read by whoever asks. Thread-safe.
class StatusBoard {
 public:
  explicit StatusBoard(std::string software_version) {
    status_.software_version = std::move(software_version);
  }

  /// `change` is called with the status; it is short.
  template <typename Change>
  void update(Change change) {
    const std::lock_guard lock(mutex_);
    change(status_);
  }

  [[nodiscard]] ControlStatus status() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }

 private:
  mutable std::mutex mutex_;
  ControlStatus status_;  ///< guarded by mutex_
};

}  // namespace trigmesh
