#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

// Each function exists twice: on a given FileSystem, and on the machine's.

/// Whether a file must survive a power cut, or can be made again and should not wait for the disk.
enum class Durability { kSynced, kCache };

/// Replaces the file or leaves it as it was: writes `.NAME.part` beside it, fsyncs (kSynced),
/// renames, fsyncs the folder (kSynced). After a failure the part file is gone; when only the last
/// step fails the file is already the new one, but may not survive a power cut. kNoSpace for a full
/// disk or quota, kIo otherwise (missing folder, permission, device).
[[nodiscard]] Result<> write_file_atomically(FileSystem& files,
                                             const std::filesystem::path& path,
                                             std::string_view bytes,
                                             Durability durability = Durability::kSynced);
[[nodiscard]] Result<> write_file_atomically(const std::filesystem::path& path,
                                             std::string_view bytes,
                                             Durability durability = Durability::kSynced);

/// Makes the folder and its parents; no failure when it is there. kSynced: those that were missing
/// survive a power cut.
[[nodiscard]] Result<> make_directory(FileSystem& files,
                                      const std::filesystem::path& path,
                                      Durability durability = Durability::kCache);
[[nodiscard]] Result<> make_directory(const std::filesystem::path& path);

/// Makes the names in this folder survive a power cut. Some file systems refuse fsync on folders
/// (EINVAL); that is no failure.
[[nodiscard]] Result<> sync_directory(FileSystem& files, const std::filesystem::path& folder);

/// fsyncs every file and folder below and including `folder`. Links and devices are left out.
[[nodiscard]] Result<> sync_tree(FileSystem& files, const std::filesystem::path& folder);

/// Removes a file, or a folder with everything in it; links are removed, not followed. No failure
/// when there is nothing. kIo.
[[nodiscard]] Result<> remove_tree(FileSystem& files, const std::filesystem::path& path);

/// Sum of the sizes of all files below `folder`, bytes; 0 when there is none. kIo.
[[nodiscard]] Result<std::uint64_t> tree_size_bytes(FileSystem& files,
                                                    const std::filesystem::path& folder);

/// Puts the folder `staged` in the place of `target` in one step (Linux renameat2 exchange), so
/// that a reader sees the old one or the new one, whole; then removes the old one. Both on the same
/// file system. Files in `staged` must be on disk already (write_file_atomically does that). Where
/// the file system cannot exchange (some network and FUSE ones), the old folder is set aside first
/// as `TARGET.old`, and put back when the second step fails.
[[nodiscard]] Result<> replace_directory(FileSystem& files,
                                         const std::filesystem::path& staged,
                                         const std::filesystem::path& target);
[[nodiscard]] Result<> replace_directory(const std::filesystem::path& staged,
                                         const std::filesystem::path& target);

/// Finishes what replace_directory left behind when it was cut between the two steps: an old folder
/// without a new one gets its name back, one beside a new one is removed. kIo.
[[nodiscard]] Result<> finish_replacement(FileSystem& files, const std::filesystem::path& target);

}  // namespace trigmesh
