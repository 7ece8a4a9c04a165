#include "firmware/control/event_stream.hpp"

#include <charconv>
#include <utility>

namespace trigmesh {
namespace {

/// What follows "NAME: ", or nothing when the line is another field.
bool take_field(std::string_view line, std::string_view name, std::string_view& value) {
  if (!line.starts_with(name) || line.substr(name.size(), 1) != ":") {
    return false;
  }
  value = line.substr(name.size() + 1);
  if (value.starts_with(' ')) {
    value.remove_prefix(1);
  }
  return true;
}

}  // namespace

Result<std::vector<ControlEvent>> EventStreamReader::add(std::string_view bytes) {
  std::vector<ControlEvent> events;
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view piece = bytes.substr(0, end);
    if (rest_.size() + piece.size() + event_.data.size() > kMaxEventBytes) {
      return fail(ErrorCode::kCorruptData,
                  "cannot read the events of the rig: one is longer than {} bytes",
                  kMaxEventBytes);
    }
    rest_ += piece;
    if (end == std::string_view::npos) {
      break;
    }
    bytes.remove_prefix(end + 1);
    const std::string line = std::exchange(rest_, {});
    take_line(line, events);
  }
  return events;
}

void EventStreamReader::take_line(std::string_view line, std::vector<ControlEvent>& events) {
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  std::string_view value;
  if (line.empty()) {
    if (!event_.kind.empty()) {
      events.push_back(std::exchange(event_, {}));
    }
  } else if (take_field(line, "event", value)) {
    event_.kind = value;
  } else if (take_field(line, "data", value)) {
    event_.data = value;
  } else if (take_field(line, "id", value)) {
    std::uint64_t number = 0;
    const auto [stop, error] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (error == std::errc{} && stop == value.data() + value.size()) {
      event_.number = number;
    }
  }
}

}  // namespace trigmesh
