#include <cstddef>
#include <cstdint>

#include "firmware/base/check.hpp"
#include "sfm/exchange/projections.hpp"
#include "tests/fuzz/pieces.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Whatever is accepted has a name and finite numbers.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto projections = trigmesh::read_projections(trigmesh::fuzz::as_text(data, size));
  if (!projections) {
    return 0;
  }
  for (const trigmesh::NamedProjection& entry : *projections) {
    TM_CHECK(!entry.name.empty() && entry.projection.allFinite());
  }
  return 0;
}
