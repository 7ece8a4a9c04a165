#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace trigmesh {

struct RectangleSize {
  int width = 0;
  int height = 0;
};

struct RectanglePlace {
  std::uint16_t page = 0;
  int x = 0;
  int y = 0;
};

struct Packing {
  std::vector<RectanglePlace> places;  ///< in the order of the sizes
  int page_count = 0;
};

/// Places rectangles without overlap on square pages, tallest first, each at the lowest and then
/// leftmost free place above the skyline of the first page that has one (Jylaenki, "A Thousand Ways
/// to Pack the Bin", 2010, SKYLINE-BL). Nothing when they do not fit on `max_pages`.
[[nodiscard]] std::optional<Packing> pack_rectangles(std::span<const RectangleSize> sizes,
                                                     int page_size,
                                                     int max_pages);

}  // namespace trigmesh
