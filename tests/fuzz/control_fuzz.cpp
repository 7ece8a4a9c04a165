// What the control interface reads: requests, answers and events, from arbitrary bytes.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "firmware/base/check.hpp"
#include "firmware/control/control_json.hpp"
#include "firmware/control/control_parse.hpp"
#include "firmware/control/event_stream.hpp"
#include "tests/fuzz/pieces.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

/// The same events in whatever pieces the bytes come.
void check_events(std::string_view text) {
  trigmesh::EventStreamReader at_once;
  trigmesh::EventStreamReader in_two;
  const auto all = at_once.add(text);
  const auto first = in_two.add(text.substr(0, text.size() / 2));
  const auto second = in_two.add(text.substr(text.size() / 2));
  if (all) {
    TM_CHECK(first && second && first->size() + second->size() == all->size());
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = trigmesh::fuzz::as_text(data, size);
  if (const auto destination = trigmesh::parse_export_request(text)) {
    TM_CHECK(destination->is_absolute());
  }
  if (const auto status = trigmesh::parse_status(text)) {
    TM_CHECK(trigmesh::parse_status(trigmesh::render_status(*status)).has_value());
  }
  if (const auto sessions = trigmesh::parse_sessions(text)) {
    TM_CHECK(trigmesh::parse_sessions(trigmesh::render_sessions(*sessions)).has_value());
  }
  (void)trigmesh::parse_devices(text);
  (void)trigmesh::parse_export(text);
  (void)trigmesh::parse_model_event(text);
  (void)trigmesh::parse_progress_event(text);
  (void)trigmesh::parse_error(text);
  check_events(text);
  return 0;
}
