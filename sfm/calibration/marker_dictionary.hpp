#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace trigmesh {

/// A marker recognised in a square of bits.
struct MarkerIdentity {
  int id = 0;
  /// Quarter turns, clockwise as seen, from the marker's own orientation to how it was seen, 0..3.
  int quarter_turns = 0;
  int wrong_bits = 0;
};

/// One of the predefined ArUco dictionaries: `count` square patterns of `bits` x `bits` black and
/// white cells inside a black frame one cell wide.
struct MarkerDictionary {
  int bits = 4;    ///< 4, 5 or 6
  int count = 50;  ///< 50, 100, 250 or 1000

  /// Pattern of marker `id` in [0, count): bits row by row from the top left, the first is the
  /// highest, 1 = white.
  [[nodiscard]] std::uint64_t pattern(int id) const;

  /// How many wrong bits still leave only one possible marker: (smallest Hamming distance - 1) / 2,
  /// as published.
  [[nodiscard]] int correctable_bits() const;

  /// The marker whose pattern, in one of four orientations, differs in at most `max_wrong_bits`
  /// bits. Nothing when there is none. O(count).
  [[nodiscard]] std::optional<MarkerIdentity> identify(std::uint64_t seen,
                                                       int max_wrong_bits) const;

  bool operator==(const MarkerDictionary&) const = default;
};

/// "4x4_50" ... "6x6_1000".
[[nodiscard]] std::string to_string(const MarkerDictionary& dictionary);

/// Also accepts OpenCV's spelling, "DICT_4X4_50".
[[nodiscard]] std::optional<MarkerDictionary> marker_dictionary_from_string(std::string_view name);

}  // namespace trigmesh
