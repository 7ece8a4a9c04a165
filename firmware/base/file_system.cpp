#include "firmware/base/file_system.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

/// Repeats an interrupted call; -1 becomes errno.
template <typename Call>
auto checked(Call call) -> SystemResult<decltype(call())> {
  while (true) {
    const auto returned = call();
    if (returned >= 0) {
      return returned;
    }
    if (errno != EINTR) {
      return tl::unexpected(errno);
    }
  }
}

template <typename Call>
SystemResult<> checked_void(Call call) {
  const auto returned = checked(call);
  return returned ? SystemResult<>() : tl::unexpected(returned.error());
}

int flags_of(OpenMode mode) {
  switch (mode) {
    case OpenMode::kRead:
      return O_RDONLY | O_CLOEXEC;
    case OpenMode::kCreate:
      return O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW;
    case OpenMode::kAppend:
      return O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW;
  }
  return O_RDONLY | O_CLOEXEC;
}

}  // namespace

SystemResult<int> RealFileSystem::open(const Path& path, OpenMode mode) {
  constexpr mode_t kPermissions = 0666;  // the umask takes its part away
  return checked([&] { return ::open(path.c_str(), flags_of(mode), kPermissions); });
}

SystemResult<std::size_t> RealFileSystem::write(int fd, std::string_view bytes) {
  return checked([&] { return ::write(fd, bytes.data(), bytes.size()); }).map([](ssize_t count) {
    return static_cast<std::size_t>(count);
  });
}

SystemResult<std::size_t> RealFileSystem::read(int fd, std::span<char> room) {
  return checked([&] { return ::read(fd, room.data(), room.size()); }).map([](ssize_t count) {
    return static_cast<std::size_t>(count);
  });
}

SystemResult<> RealFileSystem::sync(int fd) {
  return checked_void([&] { return ::fsync(fd); });
}

SystemResult<> RealFileSystem::truncate(int fd, std::uint64_t size_bytes) {
  return checked_void([&] { return ::ftruncate(fd, static_cast<off_t>(size_bytes)); });
}

SystemResult<> RealFileSystem::forget_cached(int fd) {
  const int failed = ::posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
  return failed == 0 ? SystemResult<>() : tl::unexpected(failed);
}

SystemResult<> RealFileSystem::close(int fd) {
  // Never repeated: Linux has released the descriptor also when it says EINTR.
  return ::close(fd) == 0 || errno == EINTR ? SystemResult<>() : tl::unexpected(errno);
}

SystemResult<> RealFileSystem::rename(const Path& from, const Path& to) {
  return checked_void([&] { return ::rename(from.c_str(), to.c_str()); });
}

SystemResult<> RealFileSystem::exchange(const Path& a, const Path& b) {
  return checked_void(
      [&] { return ::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE); });
}

SystemResult<> RealFileSystem::remove_file(const Path& path) {
  return checked_void([&] { return ::unlink(path.c_str()); });
}

SystemResult<> RealFileSystem::remove_folder(const Path& path) {
  return checked_void([&] { return ::rmdir(path.c_str()); });
}

SystemResult<> RealFileSystem::make_folder(const Path& path) {
  constexpr mode_t kPermissions = 0777;  // the umask takes its part away
  return checked_void([&] { return ::mkdir(path.c_str(), kPermissions); });
}

SystemResult<std::vector<FolderEntry>> RealFileSystem::list(const Path& folder) {
  std::vector<FolderEntry> entries;
  std::error_code error;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const SystemResult<FileStatus> found = status(entry->path());
    if (found) {  // else it went away in between
      entries.push_back({entry->path().filename().string(), *found});
    }
  }
  if (error) {
    return tl::unexpected(error.value());
  }
  std::sort(entries.begin(), entries.end(), [](const FolderEntry& a, const FolderEntry& b) {
    return a.name < b.name;
  });
  return entries;
}

SystemResult<FileStatus> RealFileSystem::status(const Path& path) {
  struct stat found {};

  if (::lstat(path.c_str(), &found) != 0) {
    return tl::unexpected(errno);
  }
  if (S_ISREG(found.st_mode)) {
    return FileStatus{FileKind::kFile, static_cast<std::uint64_t>(found.st_size)};
  }
  return FileStatus{S_ISDIR(found.st_mode) ? FileKind::kFolder : FileKind::kOther, 0};
}

SystemResult<DiskSpace> RealFileSystem::space(const Path& path) {
  struct statvfs found {};

  const SystemResult<> done = checked_void([&] { return ::statvfs(path.c_str(), &found); });
  if (!done) {
    return tl::unexpected(done.error());
  }
  const std::uint64_t block = found.f_frsize;
  return DiskSpace{found.f_bavail * block, found.f_blocks * block};
}

FileSystem& real_file_system() {
  static RealFileSystem files;
  return files;
}

}  // namespace trigmesh
