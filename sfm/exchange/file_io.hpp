#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "firmware/base/file_bytes.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// The largest model file that is read into memory unless the caller says otherwise.
inline constexpr std::size_t kMaxModelFileBytes = std::size_t{1} << 30;

/// Whether a file must survive a power cut, or can be made again and should not wait for the disk.
enum class Durability { kSynced, kCache };

/// Replaces the file or leaves it as it was: writes `.NAME.part` beside it, fsyncs (kSynced),
/// renames. After a failure the part file is gone. kNoSpace for a full disk or quota, kIo otherwise
/// (missing folder, permission, device).
[[nodiscard]] Result<> write_file_atomically(const std::filesystem::path& path,
                                             std::string_view bytes,
                                             Durability durability = Durability::kSynced);

/// Makes the folder and its parents; no failure when it is there.
[[nodiscard]] Result<> make_directory(const std::filesystem::path& path);

/// Puts the folder `staged` in the place of `target` in one step (Linux renameat2 exchange), so
/// that a reader sees the old one or the new one, whole; then removes the old one. Both on the same
/// file system. Files in `staged` must be on disk already (write_file_atomically does that). Where
/// the file system cannot exchange (some network and FUSE ones), the old folder is set aside first,
/// and put back when the second step fails.
[[nodiscard]] Result<> replace_directory(const std::filesystem::path& staged,
                                         const std::filesystem::path& target);

}  // namespace trigmesh
