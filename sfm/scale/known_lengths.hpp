#pragma once

#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// Largest side of a marker's black square, metres. A number above it was meant in another unit.
inline constexpr double kMaxMarkerSideM = 2.0;
/// Largest distance between two markers, metres.
inline constexpr double kMaxKnownDistanceM = 100.0;
/// How well a stated length is taken to be known, standard deviation as a part of it: 0.1 mm of a
/// card of 100 mm, what a ruler tells.
inline constexpr double kKnownLengthSdRatio = 0.001;

/// Two markers, the smaller number first.
using MarkerPair = std::pair<int, int>;

/// What is known of markers in a scene before it is measured.
struct KnownLengths {
  /// Side of every marker that is not named below; absent: no other marker counts.
  std::optional<double> marker_side_m{};
  std::map<int, double> side_of_marker_m{};   ///< by number
  std::map<MarkerPair, double> distance_m{};  ///< between the middles of two markers

  /// Whether anything is known.
  [[nodiscard]] bool any() const;
  /// Side of a marker, if it is known.
  [[nodiscard]] std::optional<double> side_m(int marker) const;
  /// Whether a length of this marker, or from it, is known; others are passed over.
  [[nodiscard]] bool names(int marker) const;
  /// kInvalidArgument, naming the length: out of its range; a marker that does not exist in a
  /// dictionary of `marker_count`; a distance from a marker to itself or with the larger number
  /// first.
  [[nodiscard]] Result<> validate(int marker_count) const;

  bool operator==(const KnownLengths&) const = default;
};

/// Where the direction up of the model comes from.
enum class UpSource {
  kNone,  ///< it keeps the direction that mapping chose
  kCard,  ///< markers lie flat: up is where they look
};

/// "none", "card".
[[nodiscard]] std::string_view to_string(UpSource source);
[[nodiscard]] std::optional<UpSource> up_source_from_string(std::string_view name);

}  // namespace trigmesh
