#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>

#include "drivers/trigger/scripted/event_table.hpp"
#include "firmware/base/check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Edges that are accepted are in order, alternate for each line, and are within the limit.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMaxRows = 100;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto edges =
      trigmesh::parse_events(text, "fuzz", trigmesh::ButtonWiring::kActiveLow, kMaxRows);
  if (!edges) {
    return 0;
  }
  TM_CHECK(edges->size() <= kMaxRows);
  std::chrono::nanoseconds last_time{0};
  std::map<std::uint32_t, trigmesh::TriggerAction> last_actions;
  for (const trigmesh::TriggerEdge& edge : *edges) {
    TM_CHECK(edge.timestamp >= last_time && edge.button <= trigmesh::kMostEventLine);
    last_time = edge.timestamp;
    const auto [last, is_first] =
        last_actions.try_emplace(edge.button, trigmesh::TriggerAction::kReleased);
    TM_CHECK(last->second != edge.action);
    last->second = edge.action;
  }
  return 0;
}
