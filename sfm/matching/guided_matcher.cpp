#include "sfm/matching/guided_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>

#include <Eigen/Geometry>

#include "firmware/base/check.hpp"
#include "sfm/matching/line_kernel.hpp"

namespace trigmesh {
namespace {

using internal::LineGate;
using internal::NearestTwo;
using internal::PointStrips;

constexpr double kStripPx = 64.0;
constexpr double kCellPx = 8.0;
/// On a side, however large the image.
constexpr double kMostCells = 512.0;

/// Smallest box around the finite points; low above high when there are none.
struct Box {
  Eigen::Array2d low = Eigen::Array2d::Constant(std::numeric_limits<double>::max());
  Eigen::Array2d high = Eigen::Array2d::Constant(std::numeric_limits<double>::lowest());
};

Box bounding_box(std::span<const Eigen::Vector2d> points) {
  Box box;
  for (const Eigen::Vector2d& point : points) {
    if (point.allFinite()) {
      box.low = box.low.min(point.array());
      box.high = box.high.max(point.array());
    }
  }
  return box;
}

/// Counting sort of the finite points into strips along one axis.
PointStrips make_strips(std::span<const Eigen::Vector2d> points, const Box& box, int along) {
  PointStrips out;
  out.along = along;
  if (box.low[0] > box.high[0]) {
    return out;
  }
  const int across = 1 - along;
  const Eigen::Array2d size = box.high - box.low;
  const double strip_px = std::max(kStripPx, size[along] / kMostCells);
  const double cell_px = std::max(kCellPx, size[across] / kMostCells);
  out.strips = static_cast<int>(size[along] / strip_px) + 1;
  out.cells = static_cast<int>(size[across] / cell_px) + 1;
  out.strip_begin_px = static_cast<float>(box.low[along]);
  out.cell_begin_px = static_cast<float>(box.low[across]);
  out.strip_px = static_cast<float>(strip_px);
  out.cell_px = static_cast<float>(cell_px);
  const auto cell_of = [&](const Eigen::Vector2d& point) {
    const auto strip = static_cast<std::size_t>((point[along] - box.low[along]) / strip_px);
    const auto cell = static_cast<std::size_t>((point[across] - box.low[across]) / cell_px);
    return strip * static_cast<std::size_t>(out.cells) + cell;
  };
  out.starts.assign(static_cast<std::size_t>(out.strips) * static_cast<std::size_t>(out.cells) + 1,
                    0);
  for (const Eigen::Vector2d& point : points) {
    if (point.allFinite()) {
      ++out.starts[cell_of(point) + 1];
    }
  }
  std::partial_sum(out.starts.begin(), out.starts.end(), out.starts.begin());
  const std::size_t padded = out.starts.back() + internal::kStripPadding;
  out.x_px.resize(padded);
  out.y_px.resize(padded);
  out.members.resize(padded);
  std::vector<std::uint32_t> next(out.starts.begin(), out.starts.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].allFinite()) {
      const std::uint32_t place = next[cell_of(points[i])]++;
      out.x_px[place] = static_cast<float>(points[i].x());
      out.y_px[place] = static_cast<float>(points[i].y());
      out.members[place] = static_cast<std::uint32_t>(i);
    }
  }
  return out;
}

/// Gate for the points of the second image that belong to `point` of the first: within the error of
/// its line, and it of theirs.
LineGate make_gate(const Eigen::Matrix3d& fundamental,
                   const Eigen::Vector2d& point,
                   double max_error_px) {
  const Eigen::Vector3d line = fundamental * point.homogeneous();
  const double scale = 1.0 / line.head<2>().norm();
  LineGate gate;
  for (int i = 0; i < 3; ++i) {
    const auto place = static_cast<std::size_t>(i);
    gate.line[place] = static_cast<float>(scale * line[i]);
    gate.back_x[place] = static_cast<float>(scale * fundamental(i, 0));
    gate.back_y[place] = static_cast<float>(scale * fundamental(i, 1));
  }
  gate.limit = static_cast<float>(max_error_px * max_error_px);
  return gate;
}

/// Among equals the lowest position stays, in whatever order they come.
void take_in(std::int32_t score, std::size_t position, NearestTwo& nearest) {
  if (score > nearest.best || (score == nearest.best && position < nearest.position)) {
    nearest = {
        .best = score, .second = nearest.best, .position = static_cast<std::uint32_t>(position)};
  } else {
    nearest.second = std::max(nearest.second, score);
  }
}

/// Nearest neighbours in both directions, among the pairs near the epipolar lines.
struct GuidedScan {
  std::vector<NearestTwo> rows;
  std::vector<NearestTwo> columns;
};

GuidedScan scan_near_lines(const GuidedImage& first,
                           const GuidedImage& second,
                           const Eigen::Matrix3d& fundamental,
                           double max_error_px) {
  const Box box = bounding_box(second.points_px);
  const PointStrips strips[2] = {make_strips(second.points_px, box, 0),
                                 make_strips(second.points_px, box, 1)};
  GuidedScan scan{.rows = std::vector<NearestTwo>(first.index.size()),
                  .columns = std::vector<NearestTwo>(second.index.size())};
  std::vector<std::uint32_t> candidates(second.index.size() + internal::kStripPadding);
  std::vector<std::int32_t> scores(second.index.size());
  for (std::size_t i = 0; i < first.index.size(); ++i) {
    if (!first.points_px[i].allFinite()) {
      continue;
    }
    const LineGate gate = make_gate(fundamental, first.points_px[i], max_error_px);
    const int along = std::abs(gate.line[1]) >= std::abs(gate.line[0]) ? 0 : 1;
    const std::size_t count = internal::find_near_line(strips[along], gate, candidates.data());
    internal::similarities(first.index.rows(),
                           i,
                           second.index.rows(),
                           std::span(candidates).first(count),
                           scores.data());
    for (std::size_t c = 0; c < count; ++c) {
      take_in(scores[c], candidates[c], scan.rows[i]);
      take_in(scores[c], i, scan.columns[candidates[c]]);
    }
  }
  return scan;
}

}  // namespace

Result<> GuidedMatchOptions::validate() const {
  if (!(max_error_px > 0.0) || !std::isfinite(max_error_px)) {
    return fail(ErrorCode::kInvalidArgument, "max_error_px is {}, must be above 0", max_error_px);
  }
  if (!(max_ratio > 0.0 && max_ratio <= 1.0)) {
    return fail(ErrorCode::kInvalidArgument, "max_ratio is {}, must be in (0, 1]", max_ratio);
  }
  if (!(max_distance > 0.0 && max_distance <= 1.0)) {
    return fail(ErrorCode::kInvalidArgument, "max_distance is {}, must be in (0, 1]", max_distance);
  }
  return {};
}

std::vector<FeatureMatch> match_guided(const GuidedImage& first,
                                       const GuidedImage& second,
                                       const Eigen::Matrix3d& fundamental,
                                       const GuidedMatchOptions& options) {
  TM_CHECK(first.points_px.size() == first.index.size() &&
           second.points_px.size() == second.index.size());
  std::vector<FeatureMatch> matches;
  if (first.index.size() == 0 || second.index.size() == 0) {
    return matches;
  }
  const DescriptorMetric metric = first.index.rows().metric;
  TM_CHECK(metric == second.index.rows().metric &&
           first.index.rows().descriptor_bytes == second.index.rows().descriptor_bytes);

  const GuidedScan scan = scan_near_lines(first, second, fundamental, options.max_error_px);
  for (std::size_t i = 0; i < first.index.size(); ++i) {
    const NearestTwo& in_second = scan.rows[i];
    if (in_second.best == 0) {
      continue;
    }
    const NearestTwo& in_first = scan.columns[in_second.position];
    if (in_first.position != i) {
      continue;
    }
    const double length_product =
        metric == DescriptorMetric::kHamming
            ? static_cast<double>(8 * first.index.rows().descriptor_bytes)
            : first.index.length(i) * second.index.length(in_second.position);
    const double similarity_ratio = in_second.best / length_product;
    const double distance = metric == DescriptorMetric::kHamming
                                ? 1.0 - similarity_ratio
                                : 0.5 * std::sqrt(std::max(0.0, 2.0 - 2.0 * similarity_ratio));
    if (distance <= options.max_distance &&
        passes_ratio_test(
            metric, in_second.best, in_second.second, length_product, options.max_ratio) &&
        passes_ratio_test(
            metric, in_first.best, in_first.second, length_product, options.max_ratio)) {
      matches.push_back({id_of<FeatureIndex>(i), id_of<FeatureIndex>(in_second.position)});
    }
  }
  return matches;
}

}  // namespace trigmesh
