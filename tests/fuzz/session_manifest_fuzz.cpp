#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/base/check.hpp"
#include "firmware/session/manifest.hpp"
#include "firmware/session/session_id.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// What is accepted has the id of a session, and is read as it was written.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto manifest = trigmesh::parse_manifest(text, "fuzz");
  if (manifest) {
    TM_CHECK(trigmesh::is_session_id(manifest->id));
    const auto again = trigmesh::parse_manifest(trigmesh::render_manifest(*manifest), "fuzz");
    TM_CHECK(again.has_value() && *again == *manifest);
  }
  return 0;
}
