#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/image_features.hpp"
#include "firmware/pipeline/matching_stage.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// What is accepted is consistent and is written as it was read. The first byte chooses the record.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  if (data[0] % 2 == 0) {
    if (const auto image = trigmesh::decode_image_features(bytes)) {
      TM_CHECK(image->colors.size() == image->features.size());
      TM_CHECK(trigmesh::encode_image_features(*image).size() == bytes.size());
    }
  } else if (const auto pairs = trigmesh::decode_pairs(bytes)) {
    TM_CHECK(trigmesh::encode_pairs(*pairs).size() == bytes.size());
  }
  return 0;
}
