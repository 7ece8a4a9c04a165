#include "sfm/exchange/file_io.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/base/check.hpp"
#include "firmware/base/unique_fd.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> system_failure(int error_number,
                                     std::string_view attempt,
                                     const fs::path& path) {
  return tl::unexpected<Error>(system_error(error_number, attempt, path));
}

/// 0 or errno.
int write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) {
        continue;
      }
      return errno;
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// 0 or errno; the bytes are on the disk when it returns 0.
int write_new_file(const fs::path& path, std::string_view bytes, Durability durability) {
  constexpr mode_t kMode = 0666;  // the umask takes its part away
  UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, kMode));
  if (!fd.valid()) {
    return errno;
  }
  if (const int failed = write_all(fd.get(), bytes); failed != 0) {
    return failed;
  }
  if (durability == Durability::kSynced && ::fsync(fd.get()) != 0) {
    return errno;
  }
  return fd.close();
}

/// Makes a rename in this folder survive a power cut. Some file systems refuse fsync on folders;
/// that is no failure.
void sync_directory(const fs::path& directory) {
  const fs::path name = directory.empty() ? fs::path(".") : directory;
  const UniqueFd fd(::open(name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.valid()) {
    (void)::fsync(fd.get());
  }
}

/// The folder that holds `path`, also for "model/" with a slash at the end.
fs::path parent_of(const fs::path& path) {
  return path.has_filename() ? path.parent_path() : path.parent_path().parent_path();
}

fs::path without_trailing_slash(const fs::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

/// For file systems without an exchange: old aside, new in, old away.
Result<> replace_in_two_steps(const fs::path& staged, const fs::path& target) {
  fs::path aside = target;
  aside += ".old";
  std::error_code ignored;
  fs::remove_all(aside, ignored);
  if (::rename(target.c_str(), aside.c_str()) != 0) {
    return system_failure(errno, "cannot set aside", target);
  }
  if (::rename(staged.c_str(), target.c_str()) != 0) {
    const int reason = errno;
    (void)::rename(aside.c_str(), target.c_str());  // the report is about the first failure
    return system_failure(reason, "cannot replace", target);
  }
  fs::remove_all(aside, ignored);
  return {};
}

}  // namespace

Result<> write_file_atomically(const fs::path& path,
                               std::string_view bytes,
                               Durability durability) {
  const fs::path part = path.parent_path() / fmt::format(".{}.part", path.filename().string());
  int failed = write_new_file(part, bytes, durability);
  if (failed == 0 && ::rename(part.c_str(), path.c_str()) != 0) {
    failed = errno;
  }
  if (failed != 0) {
    (void)::unlink(part.c_str());  // it may never have been made
    Error error = system_error(failed, "cannot write", path);
    if (error.code == ErrorCode::kNotFound) {
      error.code = ErrorCode::kIo;  // what is missing is a place for output, not an input
    }
    return tl::unexpected<Error>(std::move(error));
  }
  if (durability == Durability::kSynced) {
    sync_directory(path.parent_path());
  }
  return {};
}

Result<> make_directory(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path, error)) {
    const int reason = error ? error.value() : EEXIST;
    return system_failure(
        reason == ENOENT || reason == ENOTDIR ? EEXIST : reason, "cannot make the folder", path);
  }
  return {};
}

Result<> replace_directory(const fs::path& staged_path, const fs::path& target_path) {
  const fs::path staged = without_trailing_slash(staged_path);
  const fs::path target = without_trailing_slash(target_path);
  const char* from = staged.c_str();
  const char* to = target.c_str();
  if (::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_EXCHANGE) == 0) {
    sync_directory(parent_of(target));
    std::error_code ignored;  // the old folder may stay; the new one is in place
    fs::remove_all(staged, ignored);
    return {};
  }
  if (errno == ENOENT) {  // nothing to replace, or nothing staged: then this fails too
    if (::rename(from, to) != 0) {
      return system_failure(errno, "cannot move the finished folder to", target);
    }
  } else if (errno == EINVAL || errno == ENOSYS) {
    TM_RETURN_IF_ERROR(replace_in_two_steps(staged, target));
  } else {
    return system_failure(errno, "cannot replace", target);
  }
  sync_directory(parent_of(target));
  return {};
}

}  // namespace trigmesh
