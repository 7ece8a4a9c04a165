#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// The whole file as characters. kNotFound when it does not exist, kLimitExceeded when it is longer
/// than `max_bytes`, kIo otherwise (a folder, permission, device); the message has the path and the
/// system's reason. Never holds more than `max_bytes` and one block, even when the file grows.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path,
                                            std::size_t max_bytes);
[[nodiscard]] Result<std::string> read_file(FileSystem& files,
                                            const std::filesystem::path& path,
                                            std::size_t max_bytes);

/// The same as bytes.
[[nodiscard]] Result<std::vector<std::uint8_t>> read_file_bytes(const std::filesystem::path& path,
                                                                std::size_t max_bytes);

/// What a failed system call means to us. `attempt` reads "cannot write".
[[nodiscard]] Error system_error(int error_number,
                                 std::string_view attempt,
                                 const std::filesystem::path& path);

}  // namespace trigmesh
