#include "sfm/scale/known_lengths.hpp"

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

Result<> check_length(std::string_view what, double metres, double max_m) {
  if (!(metres > 0.0 && metres <= max_m)) {
    return fail(
        ErrorCode::kInvalidArgument, "{} is {} m, must be in (0, {}] m", what, metres, max_m);
  }
  return {};
}

Result<> check_marker(int marker, int count) {
  if (marker < 0 || marker >= count) {
    return fail(ErrorCode::kInvalidArgument,
                "marker {} is not in the dictionary: its markers are 0 to {}",
                marker,
                count - 1);
  }
  return {};
}

}  // namespace

bool KnownLengths::any() const {
  return marker_side_m.has_value() || !side_of_marker_m.empty() || !distance_m.empty();
}

std::optional<double> KnownLengths::side_m(int marker) const {
  const auto named = side_of_marker_m.find(marker);
  return named == side_of_marker_m.end() ? marker_side_m : named->second;
}

bool KnownLengths::names(int marker) const {
  return side_m(marker).has_value() ||
         std::any_of(distance_m.begin(), distance_m.end(), [&](const auto& known) {
           return known.first.first == marker || known.first.second == marker;
         });
}

Result<> KnownLengths::validate(int marker_count) const {
  if (marker_side_m) {
    TM_RETURN_IF_ERROR(check_length("the side of the markers", *marker_side_m, kMaxMarkerSideM));
  }
  for (const auto& [marker, side_m] : side_of_marker_m) {
    TM_RETURN_IF_ERROR(check_marker(marker, marker_count));
    TM_RETURN_IF_ERROR(
        check_length(fmt::format("the side of marker {}", marker), side_m, kMaxMarkerSideM));
  }
  for (const auto& [markers, metres] : distance_m) {
    const auto& [first, second] = markers;
    TM_RETURN_IF_ERROR(check_marker(first, marker_count));
    TM_RETURN_IF_ERROR(check_marker(second, marker_count));
    if (first >= second) {
      return fail(ErrorCode::kInvalidArgument,
                  "the known distance {}-{} must be between two markers, the smaller number first",
                  first,
                  second);
    }
    TM_RETURN_IF_ERROR(
        check_length(fmt::format("the distance between markers {} and {}", first, second),
                     metres,
                     kMaxKnownDistanceM));
  }
  return {};
}

std::string_view to_string(UpSource source) {
  return source == UpSource::kCard ? "card" : "none";
}

std::optional<UpSource> up_source_from_string(std::string_view name) {
  for (const UpSource source : {UpSource::kNone, UpSource::kCard}) {
    if (name == to_string(source)) {
      return source;
    }
  }
  return std::nullopt;
}

}  // namespace trigmesh
