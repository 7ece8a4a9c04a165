#include "drivers/trigger/scripted/event_table.hpp"

#include <array>
#include <map>
#include <optional>

#include "drivers/device/text_lines.hpp"
#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr std::string_view kHeader = "timestamp_ns,line,edge";
constexpr std::size_t kMaxLineBytes = 4096;

/// The first three cells; further ones are for others.
std::optional<std::array<std::string_view, 3>> cells_of(std::string_view line) {
  std::array<std::string_view, 3> cells;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t comma = line.find(',');
    if (comma == std::string_view::npos && i + 1 < cells.size()) {
      return std::nullopt;
    }
    cells[i] = line.substr(0, comma);
    line.remove_prefix(comma == std::string_view::npos ? line.size() : comma + 1);
  }
  return cells;
}

std::optional<TriggerAction> action_of(std::string_view edge, ButtonWiring wiring) {
  if (edge != "falling" && edge != "rising") {
    return std::nullopt;
  }
  const bool is_pressed = (edge == "falling") == (wiring == ButtonWiring::kActiveLow);
  return is_pressed ? TriggerAction::kPressed : TriggerAction::kReleased;
}

/// Why a line is no edge, or nothing when it became `edge`.
std::optional<std::string_view> parse_row(std::string_view line,
                                          ButtonWiring wiring,
                                          TriggerEdge& edge) {
  const auto cells = cells_of(line);
  if (!cells) {
    return "expected a timestamp, a line and an edge";
  }
  const auto time = whole_number((*cells)[0]);
  const auto button = whole_number((*cells)[1]);
  const auto action = action_of((*cells)[2], wiring);
  if (!time) {
    return "the timestamp must be a whole number of nanoseconds, 0 or more";
  }
  if (!button || *button > kMostEventLine) {
    return "the line must be a whole number from 0 to 1023";
  }
  if (!action) {
    return "the edge must be 'falling' or 'rising'";
  }
  edge = {std::chrono::nanoseconds(*time), static_cast<std::uint32_t>(*button), *action};
  return std::nullopt;
}

}  // namespace

Result<std::vector<TriggerEdge>> parse_events(std::string_view text,
                                              std::string_view file,
                                              ButtonWiring wiring,
                                              std::size_t max_rows) {
  LineCursor cursor(text);
  const bool has_header =
      cursor.advance() &&
      (cursor.line() == kHeader || cursor.line().rfind(fmt::format("{},", kHeader), 0) == 0);
  if (!has_header) {
    return fail(
        ErrorCode::kCorruptData, "{}:1: the first line must begin with '{}'", file, kHeader);
  }
  std::vector<TriggerEdge> edges;
  std::map<std::uint32_t, TriggerAction> last_actions;
  while (cursor.advance()) {
    if (cursor.line().empty()) {
      continue;
    }
    if (edges.size() == max_rows) {
      return fail(
          ErrorCode::kLimitExceeded, "{}: more than {} edges, the declared limit", file, max_rows);
    }
    TriggerEdge edge;
    std::optional<std::string_view> wrong =
        cursor.line().size() > kMaxLineBytes
            ? std::optional<std::string_view>("the line is too long")
            : parse_row(cursor.line(), wiring, edge);
    if (!wrong && !edges.empty() && edge.timestamp < edges.back().timestamp) {
      wrong = "the timestamp goes back";
    }
    const auto [last, is_first] = last_actions.try_emplace(edge.button, TriggerAction::kReleased);
    if (!wrong && last->second == edge.action) {
      wrong = is_first ? "a button is released before it was pressed"
                       : "the same edge of a line twice in a row";
    }
    if (wrong) {
      return fail(ErrorCode::kCorruptData, "{}:{}: {}", file, cursor.number(), *wrong);
    }
    last->second = edge.action;
    edges.push_back(edge);
  }
  return edges;
}

}  // namespace trigmesh
