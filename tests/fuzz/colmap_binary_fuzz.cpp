#include <cstddef>
#include <cstdint>

#include "firmware/base/check.hpp"
#include "sfm/exchange/colmap_binary.hpp"
#include "tests/fuzz/pieces.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Whatever is accepted is a valid scene and is written to bytes that read back to the same bytes.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes =
      trigmesh::fuzz::split_model<trigmesh::ColmapBinary>(trigmesh::fuzz::as_text(data, size));
  (void)trigmesh::read_colmap_binary_poses(bytes.images);  // must not crash
  const auto scene = trigmesh::read_colmap_binary(bytes);
  if (!scene) {
    TM_CHECK(!scene.error().message.empty());
    return 0;
  }
  TM_CHECK(scene->validate());
  const auto written = trigmesh::write_colmap_binary(*scene);
  if (!written) {
    TM_CHECK(written.error().code == trigmesh::ErrorCode::kUnsupported);  // a name
    return 0;
  }
  const auto again = trigmesh::read_colmap_binary(*written);
  TM_CHECK(again);
  const auto rewritten = trigmesh::write_colmap_binary(*again);
  TM_CHECK(rewritten && rewritten->images == written->images &&
           rewritten->points == written->points);
  return 0;
}
