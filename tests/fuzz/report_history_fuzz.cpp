// parse_report_history on arbitrary text: an Error or a history whose positions are in range.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/report_history.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto history = trigmesh::parse_report_history({reinterpret_cast<const char*>(data), size});
  if (history) {
    for (const trigmesh::PairEvidence& pair : history->pairs) {
      TM_CHECK(index(pair.pair.first) < index(pair.pair.second));
      TM_CHECK(index(pair.pair.second) < history->images.size());
    }
  }
  return 0;
}
