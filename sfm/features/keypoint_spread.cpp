#include "sfm/features/keypoint_spread.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace trigmesh {
namespace {

constexpr double kPointsPerCell = 8.0;

/// The cell of each candidate.
std::vector<std::size_t> assign_cells(std::span<const SpreadCandidate> candidates,
                                      int width_px,
                                      int height_px,
                                      std::size_t count) {
  const double cell_count = std::max(1.0, static_cast<double>(count) / kPointsPerCell);
  const double side = std::sqrt(double{1.0} * width_px * height_px / cell_count);
  const auto columns = static_cast<std::size_t>(std::ceil(width_px / side));
  std::vector<std::size_t> cells;
  cells.reserve(candidates.size());
  for (const SpreadCandidate& candidate : candidates) {
    const auto cell = [&](float position, int limit) {
      const double inside = std::clamp(static_cast<double>(position), 0.0, limit - 1.0);
      return static_cast<std::size_t>(inside / side);
    };
    cells.push_back(cell(candidate.y_px, height_px) * columns + cell(candidate.x_px, width_px));
  }
  return cells;
}

}  // namespace

std::vector<std::size_t> spread_keypoints(std::span<const SpreadCandidate> candidates,
                                          int width_px,
                                          int height_px,
                                          std::size_t count) {
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::vector<std::size_t> cells = assign_cells(candidates, width_px, height_px, count);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(cells[a], -candidates[a].strength, a) <
           std::tuple(cells[b], -candidates[b].strength, b);
  });
  std::vector<std::size_t> rank(candidates.size());
  for (std::size_t i = 1; i < order.size(); ++i) {
    const bool is_same_cell = cells[order[i]] == cells[order[i - 1]];
    rank[order[i]] = is_same_cell ? rank[order[i - 1]] + 1 : 0;
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(rank[a], -candidates[a].strength, a) <
           std::tuple(rank[b], -candidates[b].strength, b);
  });
  order.resize(std::min(count, order.size()));
  return order;
}

}  // namespace trigmesh
