#include "firmware/photos/pressed_frames.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "drivers/trigger/scripted/event_table.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"

namespace trigmesh {
namespace {

constexpr const char* kEventsName = "events.csv";
constexpr std::size_t kMaxEventBytes = std::size_t{16} << 20U;
constexpr std::size_t kMaxEvents = 100'000;

struct Span {
  std::chrono::nanoseconds begin{};
  std::chrono::nanoseconds end = std::chrono::nanoseconds::max();
};

Result<Span> first_span(const std::vector<TriggerEdge>& edges, PressMeaning meaning) {
  const auto is_press = [](const TriggerEdge& edge) {
    return edge.action == TriggerAction::kPressed;
  };
  const auto press = std::find_if(edges.begin(), edges.end(), is_press);
  if (press == edges.end()) {
    return fail(ErrorCode::kInsufficientData,
                "the button is never pressed in {}: there is nothing to take",
                kEventsName);
  }
  const auto end = std::find_if(press + 1, edges.end(), [&](const TriggerEdge& edge) {
    return edge.button == press->button && is_press(edge) == (meaning == PressMeaning::kToggle);
  });
  Span span{press->timestamp};
  if (end != edges.end()) {
    span.end = end->timestamp;
  }
  return span;
}

}  // namespace

Result<PhotoSet> frames_while_pressed(const PhotoSet& photos,
                                      const std::filesystem::path& recording,
                                      PressMeaning meaning) {
  std::vector<std::size_t> positions(photos.names.size());
  std::iota(positions.begin(), positions.end(), std::size_t{0});
  const auto text = read_file(recording / kEventsName, kMaxEventBytes);
  if (!text && text.error().code == ErrorCode::kNotFound) {
    return subset(photos, positions);
  }
  TM_RETURN_IF_ERROR(text);
  TM_ASSIGN_OR_RETURN(const auto edges,
                      parse_events(*text, kEventsName, ButtonWiring::kActiveLow, kMaxEvents));
  TM_ASSIGN_OR_RETURN(const Span span, first_span(edges, meaning));
  std::erase_if(positions, [&](std::size_t i) {
    return photos.timestamps[i] < span.begin || photos.timestamps[i] > span.end;
  });
  if (positions.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "none of the {} frames was taken between the press and its end in {}",
                photos.names.size(),
                kEventsName);
  }
  return subset(photos, positions);
}

}  // namespace trigmesh
