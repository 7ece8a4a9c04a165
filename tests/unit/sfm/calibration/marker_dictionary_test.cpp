#include "sfm/calibration/marker_dictionary.hpp"

#include <bit>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

std::vector<MarkerDictionary> all_dictionaries() {
  std::vector<MarkerDictionary> all;
  for (const int bits : {4, 5, 6}) {
    for (const int count : {50, 100, 250, 1000}) {
      all.push_back({.bits = bits, .count = count});
    }
  }
  return all;
}

/// A quarter turn clockwise by coordinates: what stood in column c, counted from the left, comes to
/// row c.
std::uint64_t quarter_turn(std::uint64_t pattern, int bits) {
  std::uint64_t result = 0;
  for (int row = 0; row < bits; ++row) {
    for (int column = 0; column < bits; ++column) {
      const std::uint64_t bit =
          (pattern >> static_cast<unsigned>(bits * bits - 1 - (row * bits + column))) & 1U;
      result |= bit << static_cast<unsigned>(bits * bits - 1 - (column * bits + (bits - 1 - row)));
    }
  }
  return result;
}

TEST(MarkerDictionary, FirstMarkerOfTheSmallestIsThePublishedOne) {
  // Rows 1011, 0101, 0011, 0010 as printed by every ArUco generator for DICT_4X4, id 0.
  EXPECT_EQ((MarkerDictionary{.bits = 4, .count = 50}.pattern(0)), 0b1011'0101'0011'0010U);
}

TEST(MarkerDictionary, NamesComeBackAsTheSameDictionary) {
  for (const MarkerDictionary& dictionary : all_dictionaries()) {
    EXPECT_EQ(marker_dictionary_from_string(to_string(dictionary)), dictionary);
  }
  EXPECT_EQ(marker_dictionary_from_string("DICT_5X5_100"),
            (MarkerDictionary{.bits = 5, .count = 100}));
  EXPECT_EQ(marker_dictionary_from_string("7x7_50"), std::nullopt);
  EXPECT_EQ(marker_dictionary_from_string("4x4_51"), std::nullopt);
}

TEST(MarkerDictionary, MarkersDifferByMoreThanTwiceTheCorrectableBitsInAllOrientations) {
  for (const MarkerDictionary& dictionary : all_dictionaries()) {
    int nearest = 64;
    for (int a = 0; a < dictionary.count; ++a) {
      std::uint64_t turned = dictionary.pattern(a);
      for (int turns = 0; turns < 4; ++turns) {
        for (int b = a; b < dictionary.count; ++b) {
          if (a != b || turns != 0) {
            nearest = std::min(nearest, std::popcount(turned ^ dictionary.pattern(b)));
          }
        }
        turned = quarter_turn(turned, dictionary.bits);
      }
    }
    EXPECT_GT(nearest, 2 * dictionary.correctable_bits()) << to_string(dictionary);
  }
}

TEST(MarkerDictionary, IdentifiesEveryMarkerInEveryOrientation) {
  const MarkerDictionary dictionary{.bits = 5, .count = 250};
  for (int id = 0; id < dictionary.count; id += 7) {
    std::uint64_t seen = dictionary.pattern(id);
    for (int turns = 0; turns < 4; ++turns) {
      const auto identity = dictionary.identify(seen, 0);
      ASSERT_TRUE(identity.has_value());
      EXPECT_EQ(identity->id, id);
      EXPECT_EQ(identity->quarter_turns, turns);
      seen = quarter_turn(seen, dictionary.bits);
    }
  }
}

TEST(MarkerDictionary, CorrectsAsManyBitsAsItPromisesAndNoMore) {
  const MarkerDictionary dictionary{.bits = 6, .count = 50};
  const std::uint64_t wrong = 0b1000'0100'0010'0001'0000'1000'0010U;  // six of 36 bits
  const auto identity =
      dictionary.identify(dictionary.pattern(17) ^ wrong, dictionary.correctable_bits());
  ASSERT_TRUE(identity.has_value());
  EXPECT_EQ(identity->id, 17);
  EXPECT_EQ(identity->wrong_bits, 6);
  EXPECT_EQ(dictionary.identify(dictionary.pattern(17) ^ wrong, 5), std::nullopt);
}

TEST(MarkerDictionary, BlackAndWhiteSquaresAreNoMarkers) {
  for (const MarkerDictionary& dictionary : all_dictionaries()) {
    const std::uint64_t white =
        (std::uint64_t{1} << static_cast<unsigned>(dictionary.bits * dictionary.bits)) - 1U;
    EXPECT_EQ(dictionary.identify(0, dictionary.correctable_bits()), std::nullopt)
        << to_string(dictionary);
    EXPECT_EQ(dictionary.identify(white, dictionary.correctable_bits()), std::nullopt)
        << to_string(dictionary);
  }
}

}  // namespace
}  // namespace trigmesh
