#include "sfm/calibration/marker_dictionary.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "sfm/calibration/aruco_patterns.hpp"

namespace trigmesh {
namespace {

constexpr std::array<int, 3> kBits{4, 5, 6};
constexpr std::array<int, 4> kCounts{50, 100, 250, 1000};
/// [bits][count]: OpenCV's maxCorrectionBits.
constexpr std::array<std::array<int, 4>, 3> kCorrectable{
    {{1, 1, 1, 0}, {3, 3, 2, 2}, {6, 5, 5, 4}}};

/// The pattern as it looks after the marker has been turned by a quarter, clockwise.
std::uint64_t turned(std::uint64_t pattern, int bits) {
  std::uint64_t result = 0;
  for (int row = 0; row < bits; ++row) {
    for (int column = 0; column < bits; ++column) {
      // The cell now at (row, column) was at (bits - 1 - column, row).
      const int source = (bits - 1 - column) * bits + row;
      const std::uint64_t bit = (pattern >> static_cast<unsigned>(bits * bits - 1 - source)) & 1U;
      result = (result << 1U) | bit;
    }
  }
  return result;
}

}  // namespace

std::uint64_t MarkerDictionary::pattern(int id) const {
  TM_CHECK(id >= 0 && id < count);
  const auto index = static_cast<std::size_t>(id);
  switch (bits) {
    case 4:
      return kAruco4x4Patterns[index];
    case 5:
      return kAruco5x5Patterns[index];
    default:
      return kAruco6x6Patterns[index];
  }
}

int MarkerDictionary::correctable_bits() const {
  const auto row = std::find(kBits.begin(), kBits.end(), bits) - kBits.begin();
  const auto column = std::find(kCounts.begin(), kCounts.end(), count) - kCounts.begin();
  TM_CHECK(row < std::ssize(kBits) && column < std::ssize(kCounts));
  return kCorrectable[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
}

std::optional<MarkerIdentity> MarkerDictionary::identify(std::uint64_t seen,
                                                         int max_wrong_bits) const {
  // Turning what was seen on to the next quarter undoes one of the quarters it was turned by.
  std::array<std::uint64_t, 4> upright{};
  std::uint64_t pattern_seen = seen;
  for (std::size_t k = 0; k < 4; ++k) {
    upright[(4 - k) % 4] = pattern_seen;
    pattern_seen = turned(pattern_seen, bits);
  }
  std::optional<MarkerIdentity> best;
  for (int id = 0; id < count; ++id) {
    const std::uint64_t expected = pattern(id);
    for (std::size_t turns = 0; turns < 4; ++turns) {
      const int wrong = std::popcount(expected ^ upright[turns]);
      if (wrong <= max_wrong_bits && (!best || wrong < best->wrong_bits)) {
        best =
            MarkerIdentity{.id = id, .quarter_turns = static_cast<int>(turns), .wrong_bits = wrong};
      }
    }
  }
  return best;
}

std::string to_string(const MarkerDictionary& dictionary) {
  return fmt::format("{0}x{0}_{1}", dictionary.bits, dictionary.count);
}

std::optional<MarkerDictionary> marker_dictionary_from_string(std::string_view name) {
  std::string lower(name);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  if (lower.starts_with("dict_")) {
    lower.erase(0, 5);
  }
  for (const int bits : kBits) {
    for (const int count : kCounts) {
      const MarkerDictionary dictionary{.bits = bits, .count = count};
      if (lower == to_string(dictionary)) {
        return dictionary;
      }
    }
  }
  return std::nullopt;
}

}  // namespace trigmesh
