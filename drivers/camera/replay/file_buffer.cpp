#include "drivers/camera/replay/file_buffer.hpp"

#include <algorithm>
#include <cerrno>

#include <fcntl.h>
#include <unistd.h>

#include "firmware/base/file_bytes.hpp"
#include "firmware/base/unique_fd.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kFirstBytes = std::size_t{256} << 10U;

}  // namespace

Result<std::vector<std::uint8_t>> read_file_again(const std::filesystem::path& path,
                                                  std::size_t max_bytes,
                                                  std::vector<std::uint8_t> reuse) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd.valid()) {
    return tl::unexpected<Error>(system_error(errno, "cannot open", path));
  }
  // The size that a file has now is not asked for: it may grow, and devices have none.
  std::size_t size = 0;
  reuse.resize(std::max(reuse.capacity(), kFirstBytes));
  while (true) {
    if (size == reuse.size()) {
      reuse.resize(2 * reuse.size());
    }
    const ssize_t got = ::read(fd.get(), reuse.data() + size, reuse.size() - size);
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got < 0) {
      return tl::unexpected<Error>(system_error(errno, "cannot read", path));
    }
    size += static_cast<std::size_t>(got);
    if (size > max_bytes) {
      return fail(ErrorCode::kLimitExceeded,
                  "cannot read {}: it is longer than {} bytes",
                  path.string(),
                  max_bytes);
    }
    if (got == 0) {
      reuse.resize(size);
      return reuse;
    }
  }
}

}  // namespace trigmesh
