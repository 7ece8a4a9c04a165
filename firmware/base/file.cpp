#include "firmware/base/file.hpp"

#include <cerrno>
#include <utility>

#include "firmware/base/file_bytes.hpp"

namespace trigmesh {
namespace {

Result<> explained(SystemResult<> done,
                   std::string_view attempt,
                   const std::filesystem::path& path) {
  if (!done) {
    return tl::unexpected<Error>(system_error(done.error(), attempt, path));
  }
  return {};
}

}  // namespace

Result<File> File::open(FileSystem& files, const std::filesystem::path& path, OpenMode mode) {
  const SystemResult<int> fd = files.open(path, mode);
  if (!fd) {
    return tl::unexpected<Error>(system_error(fd.error(), "cannot open", path));
  }
  return File(files, path, *fd);
}

File::File(File&& other) noexcept
    : files_(other.files_), path_(std::move(other.path_)), fd_(std::exchange(other.fd_, -1)) {}

File& File::operator=(File&& other) noexcept {
  std::swap(files_, other.files_);
  std::swap(path_, other.path_);
  std::swap(fd_, other.fd_);
  return *this;
}

File::~File() {
  if (fd_ >= 0) {
    (void)files_->close(fd_);  // whoever wants to know calls close()
  }
}

Result<> File::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const SystemResult<std::size_t> taken = files_->write(fd_, bytes);
    if (!taken || *taken == 0) {
      return tl::unexpected<Error>(
          system_error(taken ? EIO : taken.error(), "cannot write", path_));
    }
    bytes.remove_prefix(*taken);
  }
  return {};
}

Result<std::size_t> File::read(std::span<char> room) {
  const SystemResult<std::size_t> got = files_->read(fd_, room);
  if (!got) {
    return tl::unexpected<Error>(system_error(got.error(), "cannot read", path_));
  }
  return *got;
}

Result<> File::sync() {
  return explained(files_->sync(fd_), "cannot put on the disk", path_);
}

Result<> File::truncate(std::uint64_t size_bytes) {
  return explained(files_->truncate(fd_, size_bytes), "cannot shorten", path_);
}

Result<> File::forget_cached() {
  return explained(files_->forget_cached(fd_), "cannot read from the device", path_);
}

Result<> File::close() {
  return explained(files_->close(std::exchange(fd_, -1)), "cannot finish writing", path_);
}

}  // namespace trigmesh
