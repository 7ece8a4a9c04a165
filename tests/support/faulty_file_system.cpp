#include "tests/support/faulty_file_system.hpp"

#include <unistd.h>

namespace trigmesh::test_support {

void FaultyFileSystem::end_process() {
  if (power_cut_ && fault_.kind == FaultKind::kPowerCut) {
    power_cut_->lose_everything();
  } else if (power_cut_ && fault_.kind == FaultKind::kPowerCutPartly) {
    power_cut_->lose_some(fault_.at_call);
  }
  ::_exit(kKilledExitCode);
}

int FaultyFileSystem::next_call(Effect effect) {
  ++calls_;
  const bool here = calls_ == fault_.at_call;
  switch (fault_.kind) {
    case FaultKind::kKill:
    case FaultKind::kPowerCut:
    case FaultKind::kPowerCutPartly:
      if (here) {
        end_process();
      }
      return 0;
    case FaultKind::kFail:
      return here ? fault_.error_number : 0;
    case FaultKind::kFailFromThere:
      return calls_ >= fault_.at_call && effect == Effect::kChanges ? fault_.error_number : 0;
    case FaultKind::kShortThenFail:
      return calls_ == fault_.at_call + 1 ? fault_.error_number : 0;
    case FaultKind::kNone:
    case FaultKind::kShortWrite:
    case FaultKind::kTornWriteKill:
      return 0;
  }
  return 0;
}

SystemResult<int> FaultyFileSystem::open(const Path& path, OpenMode mode) {
  const bool writes = mode != OpenMode::kRead;
  if (const int failed = next_call(writes ? Effect::kChanges : Effect::kLooks); failed != 0) {
    return tl::unexpected(failed);
  }
  if (power_cut_ && writes) {
    power_cut_->before_open_for_writing(path);
  }
  return RealFileSystem::open(path, mode);
}

SystemResult<std::size_t> FaultyFileSystem::write(int fd, std::string_view bytes) {
  if (const int failed = next_call(Effect::kChanges); failed != 0) {
    return tl::unexpected(failed);
  }
  write_calls_.push_back(calls_);
  if (power_cut_) {
    power_cut_->before_write(fd);
  }
  if (calls_ == fault_.at_call && fault_.kind == FaultKind::kTornWriteKill) {
    (void)RealFileSystem::write(fd, bytes.substr(0, bytes.size() / 2));
    end_process();
  }
  if (calls_ == fault_.at_call && bytes.size() > 1 &&
      (fault_.kind == FaultKind::kShortThenFail || fault_.kind == FaultKind::kShortWrite)) {
    const bool half = fault_.kind == FaultKind::kShortThenFail;
    return RealFileSystem::write(fd, bytes.substr(0, half ? bytes.size() / 2 : 1));
  }
  return RealFileSystem::write(fd, bytes);
}

SystemResult<std::size_t> FaultyFileSystem::read(int fd, std::span<char> room) {
  const int failed = next_call(Effect::kLooks);
  return failed == 0 ? RealFileSystem::read(fd, room) : tl::unexpected(failed);
}

SystemResult<> FaultyFileSystem::sync(int fd) {
  if (const int failed = next_call(Effect::kChanges); failed != 0) {
    return tl::unexpected(failed);
  }
  // Not the disk's own fsync: what a power cut takes is decided here, and tests stay quick.
  if (power_cut_) {
    power_cut_->after_sync(fd);
  }
  return {};
}

SystemResult<> FaultyFileSystem::truncate(int fd, std::uint64_t size_bytes) {
  if (const int failed = next_call(Effect::kChanges); failed != 0) {
    return tl::unexpected(failed);
  }
  if (power_cut_) {
    power_cut_->before_truncate(fd);
  }
  return RealFileSystem::truncate(fd, size_bytes);
}

SystemResult<> FaultyFileSystem::forget_cached(int fd) {
  const int failed = next_call(Effect::kLooks);
  return failed == 0 ? RealFileSystem::forget_cached(fd) : tl::unexpected(failed);
}

SystemResult<> FaultyFileSystem::close(int fd) {
  const int failed = next_call(Effect::kLooks);
  const SystemResult<> closed = RealFileSystem::close(fd);  // as Linux does, whatever it says
  return failed == 0 ? closed : tl::unexpected(failed);
}

SystemResult<> FaultyFileSystem::rename(const Path& from, const Path& to) {
  if (const int failed = next_call(Effect::kChanges); failed != 0) {
    return tl::unexpected(failed);
  }
  if (power_cut_) {
    power_cut_->before_rename(from, to);
  }
  return RealFileSystem::rename(from, to);
}

SystemResult<> FaultyFileSystem::exchange(const Path& a, const Path& b) {
  if (const int failed = next_call(Effect::kChanges); failed != 0) {
    return tl::unexpected(failed);
  }
  if (power_cut_) {
    power_cut_->before_exchange(a, b);
  }
  return RealFileSystem::exchange(a, b);
}

SystemResult<> FaultyFileSystem::remove_file(const Path& path) {
  if (const int failed = next_call(Effect::kChanges); failed != 0) {
    return tl::unexpected(failed);
  }
  if (power_cut_) {
    power_cut_->before_remove(path);
  }
  return RealFileSystem::remove_file(path);
}

SystemResult<> FaultyFileSystem::remove_folder(const Path& path) {
  if (const int failed = next_call(Effect::kChanges); failed != 0) {
    return tl::unexpected(failed);
  }
  if (power_cut_) {
    power_cut_->before_remove(path);
  }
  return RealFileSystem::remove_folder(path);
}

SystemResult<> FaultyFileSystem::make_folder(const Path& path) {
  if (const int failed = next_call(Effect::kChanges); failed != 0) {
    return tl::unexpected(failed);
  }
  if (power_cut_) {
    power_cut_->before_make_folder(path);
  }
  return RealFileSystem::make_folder(path);
}

SystemResult<std::vector<FolderEntry>> FaultyFileSystem::list(const Path& folder) {
  const int failed = next_call(Effect::kLooks);
  if (failed != 0) {
    return tl::unexpected(failed);
  }
  return RealFileSystem::list(folder);
}

SystemResult<FileStatus> FaultyFileSystem::status(const Path& path) {
  const int failed = next_call(Effect::kLooks);
  if (failed != 0) {
    return tl::unexpected(failed);
  }
  return RealFileSystem::status(path);
}

SystemResult<DiskSpace> FaultyFileSystem::space(const Path& path) {
  const int failed = next_call(Effect::kLooks);
  if (failed != 0) {
    return tl::unexpected(failed);
  }
  SystemResult<DiskSpace> found = RealFileSystem::space(path);
  if (found && free_bytes_) {
    found->free_bytes = *free_bytes_;
  }
  return found;
}

}  // namespace trigmesh::test_support
