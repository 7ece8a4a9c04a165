#include "sfm/texture/chart_merging.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

namespace trigmesh {
namespace {

constexpr int kCellSide = 64;  // texels; only speed depends on it

std::int64_t padded_area(const Chart& chart, int padding_px) {
  return static_cast<std::int64_t>(chart.width + 2 * padding_px) * (chart.height + 2 * padding_px);
}

/// The smallest rectangle around both, without faces.
Chart around(const Chart& a, const Chart& b) {
  Chart both;
  both.view = a.view;
  both.source_x = std::min(a.source_x, b.source_x);
  both.source_y = std::min(a.source_y, b.source_y);
  both.width = std::max(a.source_x + a.width, b.source_x + b.width) - both.source_x;
  both.height = std::max(a.source_y + a.height, b.source_y + b.height) - both.source_y;
  return both;
}

/// The charts of one picture, found by where they are.
class PictureCharts {
 public:
  explicit PictureCharts(int padding_px) : padding_px_(padding_px) {}

  /// Adds a chart, joined with those beside it as long as that saves texels.
  void add(Chart chart) {
    while (const auto partner = best_partner(chart)) {
      Chart& other = charts_[*partner];
      Chart both = around(chart, other);
      both.faces = std::move(chart.faces);
      both.faces.insert(both.faces.end(), other.faces.begin(), other.faces.end());
      other.faces.clear();  // no longer there
      chart = std::move(both);
    }
    const auto number = static_cast<std::uint32_t>(charts_.size());
    for_each_cell(chart, [&](std::vector<std::uint32_t>& cell) { cell.push_back(number); });
    charts_.push_back(std::move(chart));
  }

  void move_to(std::vector<Chart>& all) {
    for (Chart& chart : charts_) {
      if (!chart.faces.empty()) {
        std::sort(chart.faces.begin(), chart.faces.end());
        all.push_back(std::move(chart));
      }
    }
  }

 private:
  template <typename Visit>
  void for_each_cell(const Chart& chart, Visit&& visit) {
    // Two rectangles can only gain where their paddings meet.
    const int x_end = (chart.source_x + chart.width + 2 * padding_px_) / kCellSide;
    const int y_end = (chart.source_y + chart.height + 2 * padding_px_) / kCellSide;
    for (int y = chart.source_y / kCellSide; y <= y_end; ++y) {
      for (int x = chart.source_x / kCellSide; x <= x_end; ++x) {
        visit(cells_[{y, x}]);
      }
    }
  }

  std::optional<std::uint32_t> best_partner(const Chart& chart) {
    std::optional<std::uint32_t> best;
    std::int64_t most_saved = -1;
    for_each_cell(chart, [&](std::vector<std::uint32_t>& cell) {
      std::erase_if(cell, [&](std::uint32_t i) { return charts_[i].faces.empty(); });
      for (const std::uint32_t i : cell) {
        const std::int64_t saved = padded_area(chart, padding_px_) +
                                   padded_area(charts_[i], padding_px_) -
                                   padded_area(around(chart, charts_[i]), padding_px_);
        if (saved > most_saved) {
          most_saved = saved;
          best = i;
        }
      }
    });
    return best;
  }

  int padding_px_;
  std::vector<Chart> charts_;
  std::map<std::pair<int, int>, std::vector<std::uint32_t>> cells_;
};

}  // namespace

std::vector<Chart> merge_close_charts(std::vector<Chart> charts, int padding_px) {
  // Large ones first, so that small ones find them.
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return padded_area(charts[a], padding_px) > padded_area(charts[b], padding_px);
  });
  std::map<std::uint32_t, PictureCharts> pictures;
  for (const std::size_t i : order) {
    pictures.try_emplace(charts[i].view, padding_px).first->second.add(std::move(charts[i]));
  }
  std::vector<Chart> merged;
  for (auto& [view, picture] : pictures) {
    picture.move_to(merged);
  }
  std::sort(merged.begin(), merged.end(), [](const Chart& a, const Chart& b) {
    return a.faces.front() < b.faces.front();
  });
  return merged;
}

}  // namespace trigmesh
