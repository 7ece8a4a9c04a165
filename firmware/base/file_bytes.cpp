#include "firmware/base/file_bytes.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/base/unique_fd.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

tl::unexpected<Error> system_failure(std::string_view attempt, const fs::path& path) {
  return tl::unexpected<Error>(system_error(errno, attempt, path));
}

/// `Bytes` is a string or a vector of bytes.
template <typename Bytes>
Result<Bytes> read_whole(const fs::path& path, std::size_t max_bytes) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd.valid()) {
    return system_failure("cannot open", path);
  }

  struct stat status {};

  if (::fstat(fd.get(), &status) != 0) {
    return system_failure("cannot read", path);
  }
  // The size is a hint only: the file may grow, and devices and pipes have none.
  Bytes bytes;
  if (S_ISREG(status.st_mode)) {
    bytes.reserve(std::min(static_cast<std::size_t>(status.st_size), max_bytes));
  }
  std::array<char, std::size_t{1} << 16> chunk;
  while (true) {
    const ssize_t got = ::read(fd.get(), chunk.data(), chunk.size());
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got < 0) {
      return system_failure("cannot read", path);
    }
    if (got == 0) {
      return bytes;
    }
    if (static_cast<std::size_t>(got) > max_bytes - bytes.size()) {
      return fail(ErrorCode::kLimitExceeded,
                  "cannot read {}: it is longer than {} bytes",
                  path.string(),
                  max_bytes);
    }
    bytes.insert(bytes.end(), chunk.begin(), chunk.begin() + got);
  }
}

}  // namespace

Result<std::string> read_file(const fs::path& path, std::size_t max_bytes) {
  return read_whole<std::string>(path, max_bytes);
}

Result<std::vector<std::uint8_t>> read_file_bytes(const fs::path& path, std::size_t max_bytes) {
  return read_whole<std::vector<std::uint8_t>>(path, max_bytes);
}

Error system_error(int error_number, std::string_view attempt, const fs::path& path) {
  ErrorCode code = ErrorCode::kIo;
  if (error_number == ENOSPC || error_number == EDQUOT) {
    code = ErrorCode::kNoSpace;
  } else if (error_number == ENOENT || error_number == ENOTDIR) {
    code = ErrorCode::kNotFound;
  }
  return {code,
          fmt::format(
              "{} {}: {}", attempt, path.string(), std::generic_category().message(error_number))};
}

}  // namespace trigmesh
