#include "tools/trigmesh/scale_arguments.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <utility>

#include "firmware/base/check.hpp"
#include "tools/trigmesh/lengths.hpp"

namespace trigmesh {
namespace {

std::optional<int> marker_from(std::string_view text) {
  int marker = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, marker);
  return error == std::errc{} && end == last ? std::optional(marker) : std::nullopt;
}

/// "100mm", or "3=120mm" for one marker.
Result<> add_side(const std::string& text, KnownLengths& known) {
  constexpr std::string_view kOption = "--marker-side";
  const std::size_t equals = text.find('=');
  const bool named = equals != std::string::npos;
  TM_ASSIGN_OR_RETURN(
      const double side_m,
      parse_length_m(
          kOption, std::string_view(text).substr(named ? equals + 1 : 0), BareNumber::kMetres));
  if (!named) {
    if (known.marker_side_m) {
      return fail(ErrorCode::kInvalidArgument,
                  "{} is given twice for all markers; write NUMBER=LENGTH for single ones",
                  kOption);
    }
    known.marker_side_m = side_m;
    return {};
  }
  const auto marker = marker_from(std::string_view(text).substr(0, equals));
  if (!marker || !known.side_of_marker_m.emplace(*marker, side_m).second) {
    return fail(ErrorCode::kInvalidArgument,
                "{} is '{}', must be a length, or the number of a marker, = and its length, each "
                "marker once",
                kOption,
                text);
  }
  return {};
}

/// "0-1=0.5m"
Result<> add_distance(const std::string& text, KnownLengths& known) {
  constexpr std::string_view kOption = "--known-distance";
  const std::size_t equals = text.find('=');
  const std::string_view pair = std::string_view(text).substr(0, equals);
  const std::size_t dash = pair.find('-');
  const auto first = marker_from(pair.substr(0, dash));
  const auto second =
      dash == std::string_view::npos ? std::nullopt : marker_from(pair.substr(dash + 1));
  if (equals == std::string::npos || !first || !second) {
    return fail(ErrorCode::kInvalidArgument,
                "{} is '{}', must be the numbers of two markers and the distance between their "
                "middles, as 0-1=50cm",
                kOption,
                text);
  }
  TM_ASSIGN_OR_RETURN(
      const double metres,
      parse_length_m(kOption, std::string_view(text).substr(equals + 1), BareNumber::kMetres));
  if (!known.distance_m.emplace(std::minmax({*first, *second}), metres).second) {
    return fail(ErrorCode::kInvalidArgument,
                "{} is given twice between markers {} and {}",
                kOption,
                *first,
                *second);
  }
  return {};
}

}  // namespace

void add_scale_options(CLI::App& command, ScaleArguments& arguments) {
  command
      .add_option("--marker-side",
                  arguments.marker_sides,
                  "Side of the black square of ArUco markers in the scene, for a model in "
                  "metres: 100mm or 0.1 for all, 3=120mm for marker 3; may come several times")
      ->allow_extra_args(false);
  command
      .add_option("--known-distance",
                  arguments.distances,
                  "Distance between the middles of two markers, as 0-1=50cm; may come several "
                  "times")
      ->allow_extra_args(false);
  command
      .add_option("--marker-dictionary",
                  arguments.dictionary,
                  "Dictionary of the markers: 4x4_50 ... 6x6_1000")
      ->capture_default_str();
  command
      .add_option("--up",
                  arguments.up,
                  "card: markers lie flat, the model gets z up, its origin on the card")
      ->check(CLI::IsMember({"none", "card"}))
      ->capture_default_str();
}

Result<ScaleOptions> scale_options_from(const ScaleArguments& arguments) {
  ScaleOptions options;
  const auto dictionary = marker_dictionary_from_string(arguments.dictionary);
  if (!dictionary) {
    return fail(ErrorCode::kInvalidArgument,
                "--marker-dictionary is '{}', must be 4x4_N, 5x5_N or 6x6_N with N one of 50, 100, "
                "250, 1000",
                arguments.dictionary);
  }
  options.dictionary = *dictionary;
  for (const std::string& text : arguments.marker_sides) {
    TM_RETURN_IF_ERROR(add_side(text, options.known));
  }
  for (const std::string& text : arguments.distances) {
    TM_RETURN_IF_ERROR(add_distance(text, options.known));
  }
  options.up = *up_source_from_string(arguments.up);  // CLI11 has checked the names
  TM_RETURN_IF_ERROR(options.validate());
  return options;
}

}  // namespace trigmesh
