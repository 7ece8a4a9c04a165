#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

/// The tables behind MarkerDictionary; see aruco_patterns.cpp for origin and bit order.
namespace trigmesh {

inline constexpr std::size_t kArucoPatternCount = 1000;

extern const std::array<std::uint16_t, kArucoPatternCount> kAruco4x4Patterns;
extern const std::array<std::uint32_t, kArucoPatternCount> kAruco5x5Patterns;
extern const std::array<std::uint64_t, kArucoPatternCount> kAruco6x6Patterns;

}  // namespace trigmesh
