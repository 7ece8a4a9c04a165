#include <cstddef>
#include <cstdint>

#include "firmware/base/check.hpp"
#include "sfm/exchange/ply.hpp"
#include "tests/fuzz/pieces.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Whatever is accepted holds finite points, confidences in range, and survives being written and
/// read again.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto cloud = trigmesh::read_dense_ply(trigmesh::fuzz::as_text(data, size));
  if (!cloud) {
    return 0;
  }
  for (const trigmesh::DensePoint& point : *cloud) {
    TM_CHECK(point.position_in_world.allFinite() && point.normal_in_world.allFinite());
    TM_CHECK(point.confidence >= 0.0F && point.confidence <= 1.0F);
  }
  const auto again = trigmesh::read_dense_ply(trigmesh::write_dense_ply(*cloud));
  TM_CHECK(again && *again == *cloud);
  return 0;
}
