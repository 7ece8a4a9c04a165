#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

namespace trigmesh {

/// What a system call returns: a value, or the errno of its failure.
template <typename T = void>
using SystemResult = tl::expected<T, int>;

/// What a name in a folder stands for. Links are kOther: they are never followed.
enum class FileKind { kFile, kFolder, kOther };

struct FileStatus {
  FileKind kind = FileKind::kOther;
  std::uint64_t size_bytes = 0;  ///< 0 unless kFile
};

struct FolderEntry {
  std::string name;
  FileStatus status;
};

struct DiskSpace {
  std::uint64_t free_bytes = 0;  ///< what an unprivileged process can still write
  std::uint64_t total_bytes = 0;
};

enum class OpenMode {
  kRead,    ///< files and folders
  kCreate,  ///< for writing, emptied if it is there; never through a link
  kAppend,  ///< for writing at the end; made if it is missing
};

/// The system calls on files, thin and one by one, so that tests can cut or fail any of them and so
/// that what is written here decides alone about durability. Everything above (whole files, atomic
/// replacement, journals) is built on it once. Thread-safe for different paths and descriptors.
class FileSystem {
 public:
  FileSystem() = default;
  FileSystem(const FileSystem&) = delete;
  FileSystem& operator=(const FileSystem&) = delete;
  FileSystem(FileSystem&&) = delete;
  FileSystem& operator=(FileSystem&&) = delete;
  virtual ~FileSystem() = default;

  using Path = std::filesystem::path;

  /// A descriptor that the caller closes with close().
  [[nodiscard]] virtual SystemResult<int> open(const Path& path, OpenMode mode) = 0;
  /// How many of the bytes were taken: perhaps not all.
  [[nodiscard]] virtual SystemResult<std::size_t> write(int fd, std::string_view bytes) = 0;
  /// How many bytes came; 0 at the end.
  [[nodiscard]] virtual SystemResult<std::size_t> read(int fd, std::span<char> room) = 0;
  /// Returns when a file's bytes, or a folder's names, are on the disk.
  [[nodiscard]] virtual SystemResult<> sync(int fd) = 0;
  [[nodiscard]] virtual SystemResult<> truncate(int fd, std::uint64_t size_bytes) = 0;
  /// Makes the next read come from the device, where the kernel can.
  [[nodiscard]] virtual SystemResult<> forget_cached(int fd) = 0;
  /// The descriptor is gone whatever is returned.
  [[nodiscard]] virtual SystemResult<> close(int fd) = 0;

  [[nodiscard]] virtual SystemResult<> rename(const Path& from, const Path& to) = 0;
  /// Both names change places in one step. EINVAL, ENOSYS where the file system cannot.
  [[nodiscard]] virtual SystemResult<> exchange(const Path& a, const Path& b) = 0;
  [[nodiscard]] virtual SystemResult<> remove_file(const Path& path) = 0;
  /// Of an empty folder.
  [[nodiscard]] virtual SystemResult<> remove_folder(const Path& path) = 0;
  [[nodiscard]] virtual SystemResult<> make_folder(const Path& path) = 0;
  /// Sorted by name, without "." and "..".
  [[nodiscard]] virtual SystemResult<std::vector<FolderEntry>> list(const Path& folder) = 0;
  [[nodiscard]] virtual SystemResult<FileStatus> status(const Path& path) = 0;
  [[nodiscard]] virtual SystemResult<DiskSpace> space(const Path& path) = 0;
};

/// The machine's. Interrupted calls are repeated.
class RealFileSystem : public FileSystem {
 public:
  [[nodiscard]] SystemResult<int> open(const Path& path, OpenMode mode) override;
  [[nodiscard]] SystemResult<std::size_t> write(int fd, std::string_view bytes) override;
  [[nodiscard]] SystemResult<std::size_t> read(int fd, std::span<char> room) override;
  [[nodiscard]] SystemResult<> sync(int fd) override;
  [[nodiscard]] SystemResult<> truncate(int fd, std::uint64_t size_bytes) override;
  [[nodiscard]] SystemResult<> forget_cached(int fd) override;
  [[nodiscard]] SystemResult<> close(int fd) override;
  [[nodiscard]] SystemResult<> rename(const Path& from, const Path& to) override;
  [[nodiscard]] SystemResult<> exchange(const Path& a, const Path& b) override;
  [[nodiscard]] SystemResult<> remove_file(const Path& path) override;
  [[nodiscard]] SystemResult<> remove_folder(const Path& path) override;
  [[nodiscard]] SystemResult<> make_folder(const Path& path) override;
  [[nodiscard]] SystemResult<std::vector<FolderEntry>> list(const Path& folder) override;
  [[nodiscard]] SystemResult<FileStatus> status(const Path& path) override;
  [[nodiscard]] SystemResult<DiskSpace> space(const Path& path) override;
};

/// The one that functions without a FileSystem argument use; it has no state.
[[nodiscard]] FileSystem& real_file_system();

}  // namespace trigmesh
