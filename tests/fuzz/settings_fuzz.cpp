#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/base/check.hpp"
#include "firmware/settings/settings.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// What is accepted is read as it was written; what is refused says why.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto settings = trigmesh::parse_settings(text, "fuzz");
  if (settings) {
    const auto again = trigmesh::parse_settings(trigmesh::render_settings(*settings), "fuzz");
    TM_CHECK(again.has_value() && *again == *settings);
  } else {
    TM_CHECK(settings.error().message.starts_with("fuzz:"));
  }
  return 0;
}
