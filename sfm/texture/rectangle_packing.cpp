#include "sfm/texture/rectangle_packing.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace trigmesh {
namespace {

/// The upper outline of what has been placed on one page.
class Skyline {
 public:
  explicit Skyline(int page_size) : page_size_(page_size), segments_{{0, 0, page_size}} {}

  [[nodiscard]] std::optional<RectanglePlace> find(RectangleSize size) const {
    std::optional<RectanglePlace> best;
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      const int x = segments_[i].x;
      if (x + size.width > page_size_) {
        break;
      }
      int y = 0;
      for (std::size_t j = i; j < segments_.size() && segments_[j].x < x + size.width; ++j) {
        y = std::max(y, segments_[j].y);
        if (best && y >= best->y) {
          break;
        }
      }
      if (y + size.height <= page_size_ && (!best || y < best->y)) {
        best = RectanglePlace{0, x, y};
      }
    }
    return best;
  }

  void place(const RectanglePlace& place, RectangleSize size) {
    const int end = place.x + size.width;
    std::vector<Segment> next;
    next.reserve(segments_.size() + 2);
    bool placed = false;
    for (const Segment& segment : segments_) {
      const int segment_end = segment.x + segment.width;
      if (segment_end <= place.x || segment.x >= end) {
        next.push_back(segment);
        continue;
      }
      if (segment.x < place.x) {
        next.push_back({segment.x, segment.y, place.x - segment.x});
      }
      if (!placed) {
        next.push_back({place.x, place.y + size.height, size.width});
        placed = true;
      }
      if (segment_end > end) {
        next.push_back({end, segment.y, segment_end - end});
      }
    }
    segments_.clear();
    for (const Segment& segment : next) {
      if (!segments_.empty() && segments_.back().y == segment.y) {
        segments_.back().width += segment.width;
      } else {
        segments_.push_back(segment);
      }
    }
  }

 private:
  struct Segment {
    int x = 0;
    int y = 0;
    int width = 0;
  };

  int page_size_;
  std::vector<Segment> segments_;
};

}  // namespace

std::optional<Packing> pack_rectangles(std::span<const RectangleSize> sizes,
                                       int page_size,
                                       int max_pages) {
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return sizes[a].height != sizes[b].height ? sizes[a].height > sizes[b].height
                                              : sizes[a].width > sizes[b].width;
  });
  Packing packing;
  packing.places.resize(sizes.size());
  std::vector<Skyline> pages;
  for (const std::size_t i : order) {
    std::optional<RectanglePlace> place;
    for (std::size_t page = 0; !place && page <= pages.size(); ++page) {
      if (page == pages.size()) {
        if (std::ssize(pages) == max_pages) {
          return std::nullopt;
        }
        pages.emplace_back(page_size);
      }
      place = pages[page].find(sizes[i]);
      if (place) {
        place->page = static_cast<std::uint16_t>(page);
        pages[page].place(*place, sizes[i]);
      } else if (sizes[i].width > page_size || sizes[i].height > page_size) {
        return std::nullopt;
      }
    }
    packing.places[i] = *place;
  }
  packing.page_count = static_cast<int>(pages.size());
  return packing;
}

}  // namespace trigmesh
