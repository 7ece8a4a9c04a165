#pragma once

#include <cstddef>

// What model files are read and written with; it lives in base because sessions need it as well.
#include "firmware/base/atomic_files.hpp"
#include "firmware/base/file_bytes.hpp"

namespace trigmesh {

/// The largest model file that is read into memory unless the caller says otherwise.
inline constexpr std::size_t kMaxModelFileBytes = std::size_t{1} << 30;

}  // namespace trigmesh
