#pragma once

#include <cerrno>
#include <utility>

#include <unistd.h>

namespace trigmesh {

/// Owns a file descriptor and closes it, whatever path is taken.
class UniqueFd {
 public:
  explicit UniqueFd(int fd) : fd_(fd) {}

  UniqueFd(const UniqueFd&) = delete;
  UniqueFd& operator=(const UniqueFd&) = delete;
  UniqueFd(UniqueFd&&) = delete;
  UniqueFd& operator=(UniqueFd&&) = delete;

  ~UniqueFd() {
    if (fd_ >= 0) {
      (void)::close(fd_);  // nothing can be done about a failure here
    }
  }

  [[nodiscard]] int get() const { return fd_; }

  [[nodiscard]] bool valid() const { return fd_ >= 0; }

  /// 0, or the errno of close, which may report a delayed write error.
  [[nodiscard]] int close() { return ::close(std::exchange(fd_, -1)) == 0 ? 0 : errno; }

 private:
  int fd_;
};

}  // namespace trigmesh
