#include "firmware/base/file_bytes.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "firmware/base/check.hpp"
#include "firmware/base/file.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

/// `Bytes` is a string or a vector of bytes.
template <typename Bytes>
Result<Bytes> read_whole(FileSystem& files, const fs::path& path, std::size_t max_bytes) {
  TM_ASSIGN_OR_RETURN(File file, File::open(files, path, OpenMode::kRead));
  // The size is a hint only: the file may grow, and devices and pipes have none.
  Bytes bytes;
  if (const auto status = files.status(path)) {
    bytes.reserve(std::min(static_cast<std::size_t>(status->size_bytes), max_bytes));
  }
  std::array<char, std::size_t{1} << 16> chunk;
  while (true) {
    TM_ASSIGN_OR_RETURN(const std::size_t got, file.read(chunk));
    if (got == 0) {
      return bytes;
    }
    if (got > max_bytes - bytes.size()) {
      return fail(ErrorCode::kLimitExceeded,
                  "cannot read {}: it is longer than {} bytes",
                  path.string(),
                  max_bytes);
    }
    bytes.insert(bytes.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(got));
  }
}

}  // namespace

Result<std::string> read_file(const fs::path& path, std::size_t max_bytes) {
  return read_whole<std::string>(real_file_system(), path, max_bytes);
}

Result<std::string> read_file(FileSystem& files, const fs::path& path, std::size_t max_bytes) {
  return read_whole<std::string>(files, path, max_bytes);
}

Result<std::vector<std::uint8_t>> read_file_bytes(const fs::path& path, std::size_t max_bytes) {
  return read_whole<std::vector<std::uint8_t>>(real_file_system(), path, max_bytes);
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
