#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// What a verified copy consists of.
struct ExportReport {
  std::filesystem::path folder;  ///< of the copy
  std::size_t file_count = 0;
  std::uint64_t size_bytes = 0;
};

/// Told of the bytes copied so far; false stops the copy.
using ExportProgress = std::function<bool(std::uint64_t copied_bytes, std::uint64_t all_bytes)>;

/// Name of the list of hashes in a copy, as `xxh128sum -c` reads it.
inline constexpr const char* kChecksumsName = "checksums.xxh128";

/// Copies the folder of a session to `destination`/NAME, on a mounted stick or wherever: aside and
/// hidden, each file fsynced, then read back from the device and its XXH3 hash (128 bit) compared,
/// then put in the place of an older copy in one step. `progress` may be empty. Hidden files are
/// left out. kNotFound (session or destination), kNoSpace (before the first byte if it is known
/// then), kCorruptData: what was read back is not what was written; kCancelled, kIo. After a
/// failure nothing of the copy stays, unless the stick is gone, and an older copy is as it was.
[[nodiscard]] Result<ExportReport> export_session(FileSystem& files,
                                                  const std::filesystem::path& session,
                                                  const std::filesystem::path& destination,
                                                  const ExportProgress& progress = {});

}  // namespace trigmesh
