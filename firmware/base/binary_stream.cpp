#include "firmware/base/binary_stream.hpp"

namespace trigmesh {

void BinaryWriter::append(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  bytes_.insert(bytes_.end(), bytes, bytes + size);
}

}  // namespace trigmesh
