#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// How much of a disk sessions may take.
struct SpaceLimits {
  /// All sessions together, bytes; 0: no quota.
  std::uint64_t quota_bytes = 0;
  /// What a capture leaves free, so that models and the system go on, bytes.
  std::uint64_t reserve_bytes = 0;
  /// The light warns when less than this can still be captured, bytes.
  std::uint64_t warn_bytes = 0;
};

enum class StorageLevel {
  kOk,
  kLow,   ///< the warning of the limits
  kFull,  ///< nothing more can be captured
};

[[nodiscard]] std::string_view to_string(StorageLevel level);

/// Counts what sessions take and asks the disk what is left. Thread-safe. `files` outlives it.
class SpaceBudget {
 public:
  SpaceBudget(FileSystem& files, std::filesystem::path root, const SpaceLimits& limits)
      : files_(files), root_(std::move(root)), limits_(limits) {}

  /// How many bytes may still be captured: the smaller of what quota and reserve leave. kIo.
  [[nodiscard]] Result<std::uint64_t> available_bytes() const;

  /// Whether so many bytes may be written. kNoSpace (says which limit), kIo.
  [[nodiscard]] Result<> admit(std::uint64_t bytes) const;

  [[nodiscard]] Result<StorageLevel> level() const;

  void add(std::uint64_t bytes) { used_bytes_ += bytes; }

  void remove(std::uint64_t bytes) { used_bytes_ -= bytes; }

  /// What was measured; add() and remove() leave small files out.
  void set_used(std::uint64_t bytes) { used_bytes_ = bytes; }

  [[nodiscard]] std::uint64_t used_bytes() const { return used_bytes_; }

 private:
  FileSystem& files_;
  std::filesystem::path root_;
  SpaceLimits limits_;
  std::atomic<std::uint64_t> used_bytes_ = 0;
};

}  // namespace trigmesh
