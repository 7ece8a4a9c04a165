#pragma once

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <mutex>

#include "firmware/base/file_system.hpp"

namespace trigmesh::test_support {

/// The machine's files, on a disk that can be full, write-protected or stuck. Thread-safe.
class TestDisk final : public RealFileSystem {
 public:
  std::atomic<bool> is_read_only = false;
  std::atomic<std::uint64_t> free_bytes = std::uint64_t{1} << 40U;

  /// While it is stuck no fsync returns.
  void set_stuck(bool is_stuck) {
    {
      const std::lock_guard lock(mutex_);
      is_stuck_ = is_stuck;
    }
    freed_.notify_all();
  }

  SystemResult<int> open(const Path& path, OpenMode mode) override {
    if (is_read_only && mode != OpenMode::kRead) {
      return tl::unexpected<int>(EROFS);
    }
    return RealFileSystem::open(path, mode);
  }

  SystemResult<std::size_t> write(int fd, std::string_view bytes) override {
    if (is_read_only) {
      return tl::unexpected<int>(EROFS);
    }
    return RealFileSystem::write(fd, bytes);
  }

  SystemResult<> sync(int fd) override {
    {
      std::unique_lock lock(mutex_);
      freed_.wait(lock, [this] { return !is_stuck_; });
    }
    (void)fd;  // tests need no durability
    return {};
  }

  SystemResult<DiskSpace> space(const Path& /*path*/) override {
    return DiskSpace{free_bytes, std::uint64_t{1} << 40U};
  }

 private:
  std::mutex mutex_;
  std::condition_variable freed_;
  bool is_stuck_ = false;  ///< guarded by mutex_
};

}  // namespace trigmesh::test_support
