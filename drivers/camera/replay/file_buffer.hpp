#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// The whole file in the memory of `reuse`, which grows only for a larger file than it ever held:
/// what read_file_bytes does, for one file after the other. Errors as there.
[[nodiscard]] Result<std::vector<std::uint8_t>> read_file_again(const std::filesystem::path& path,
                                                                std::size_t max_bytes,
                                                                std::vector<std::uint8_t> reuse);

}  // namespace trigmesh
