#include <cstddef>
#include <cstdint>

#include "firmware/base/check.hpp"
#include "sfm/exchange/ply.hpp"
#include "tests/fuzz/pieces.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Whatever is accepted holds finite points and survives being written and read again.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto points = trigmesh::read_ply(trigmesh::fuzz::as_text(data, size));
  if (!points) {
    return 0;
  }
  for (const trigmesh::ColoredPoint& point : *points) {
    TM_CHECK(point.position_in_world.allFinite());
  }
  const auto again = trigmesh::read_ply(trigmesh::write_ply(*points));
  TM_CHECK(again && *again == *points);
  return 0;
}
