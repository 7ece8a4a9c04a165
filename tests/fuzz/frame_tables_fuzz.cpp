#include <cstddef>
#include <cstdint>
#include <string_view>

#include "drivers/camera/replay/frame_tables.hpp"
#include "firmware/base/check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Rows that are accepted are safe to append to a folder and within the limit.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMaxRows = 100;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto rows = trigmesh::parse_timestamps(text, "fuzz", kMaxRows);
  if (rows) {
    TM_CHECK(rows->size() <= kMaxRows);
    for (const trigmesh::TimestampRow& row : *rows) {
      TM_CHECK(trigmesh::is_safe_frame_name(row.name) && row.timestamp.count() >= 0);
    }
  }
  const auto paths = trigmesh::parse_frame_list(text, "fuzz", kMaxRows);
  TM_CHECK(!paths || paths->size() <= kMaxRows);
  const std::size_t half = size / 2;
  TM_CHECK(!(trigmesh::natural_less(text.substr(0, half), text.substr(half)) &&
             trigmesh::natural_less(text.substr(half), text.substr(0, half))));
  return 0;
}
