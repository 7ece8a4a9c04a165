#include <cstddef>
#include <cstdint>

#include "firmware/base/check.hpp"
#include "sfm/exchange/colmap_text.hpp"
#include "tests/fuzz/pieces.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Whatever is accepted is a valid scene and is written to a text that reads back to the same text.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto text =
      trigmesh::fuzz::split_model<trigmesh::ColmapText>(trigmesh::fuzz::as_text(data, size));
  (void)trigmesh::read_colmap_cameras(text.cameras);  // must not crash
  (void)trigmesh::read_colmap_poses(text.images);
  const auto scene = trigmesh::read_colmap_text(text);
  if (!scene) {
    TM_CHECK(!scene.error().message.empty());
    return 0;
  }
  TM_CHECK(scene->validate());
  const auto written = trigmesh::write_colmap_text(*scene);
  if (!written) {
    TM_CHECK(written.error().code == trigmesh::ErrorCode::kUnsupported);  // a name
    return 0;
  }
  const auto again = trigmesh::read_colmap_text(*written);
  TM_CHECK(again);
  const auto rewritten = trigmesh::write_colmap_text(*again);
  TM_CHECK(rewritten && rewritten->images == written->images &&
           rewritten->points == written->points);
  return 0;
}
