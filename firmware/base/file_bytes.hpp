#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string_view>
#include <system_error>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {
namespace internal {

struct FileCloser {
  void operator()(std::FILE* file) const {
    (void)std::fclose(file);
  }  // read only: nothing can be lost
};

}  // namespace internal

/// Reads a whole regular file. kNotFound: there is none; kLimitExceeded: larger than `max_bytes`;
/// kIo: a folder, a pipe, no permission, a device error. Never reads more than `max_bytes + 1`
/// bytes, even when the file grows meanwhile.
[[nodiscard]] inline Result<std::vector<std::uint8_t>> read_file_bytes(
    const std::filesystem::path& path, std::size_t max_bytes) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    return fail(ErrorCode::kNotFound, "cannot read {}: there is no such file", path.string());
  }
  if (error) {
    return fail(ErrorCode::kIo, "cannot read {}: {}", path.string(), error.message());
  }
  if (status.type() != std::filesystem::file_type::regular) {
    return fail(ErrorCode::kIo, "cannot read {}: it is not a regular file", path.string());
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > max_bytes) {
    return fail(ErrorCode::kLimitExceeded,
                "{} has {} bytes, more than the limit of {} bytes",
                path.string(),
                size,
                max_bytes);
  }
  const std::unique_ptr<std::FILE, internal::FileCloser> file(std::fopen(path.c_str(), "rbe"));
  if (file == nullptr) {
    return fail(ErrorCode::kIo,
                "cannot open {}: {}",
                path.string(),
                std::generic_category().message(errno));
  }
  // One byte more than expected, to notice a file that grows while it is read.
  std::vector<std::uint8_t> bytes((error ? max_bytes : static_cast<std::size_t>(size)) + 1);
  const std::size_t count = std::fread(bytes.data(), 1, bytes.size(), file.get());
  if (std::ferror(file.get()) != 0) {
    return fail(ErrorCode::kIo,
                "cannot read {}: {}",
                path.string(),
                std::generic_category().message(errno));
  }
  if (count == bytes.size()) {
    return fail(ErrorCode::kIo, "cannot read {}: it grew while it was read", path.string());
  }
  bytes.resize(count);
  return bytes;
}

/// The same bytes seen as text; valid as long as `bytes` lives.
[[nodiscard]] inline std::string_view as_text(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace trigmesh
