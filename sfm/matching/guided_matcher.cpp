#include "sfm/matching/guided_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <Eigen/Geometry>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

using internal::NearestTwo;

/// Points sorted into strips across one axis, and by the other coordinate within a strip: the
/// points of a strip near a line are one run in memory.
class PointStrips {
 public:
  /// `along`: 0 for strips that follow each other in x, 1 for y. Points that are not finite are
  /// left out.
  PointStrips(std::span<const Eigen::Vector2d> points, int along) : along_(along) {
    double low[2] = {std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
    double high[2] = {std::numeric_limits<double>::lowest(), std::numeric_limits<double>::lowest()};
    for (const Eigen::Vector2d& point : points) {
      if (!point.allFinite()) {
        continue;
      }
      for (const int axis : {0, 1}) {
        low[axis] = std::min(low[axis], point[axis]);
        high[axis] = std::max(high[axis], point[axis]);
      }
    }
    if (low[0] > high[0]) {
      return;
    }
    const auto cells = [&](int axis, double least_px, double& cell_px) {
      cell_px = std::max(least_px, (high[axis] - low[axis]) / kMostCells);
      return static_cast<int>((high[axis] - low[axis]) / cell_px) + 1;
    };
    strip_begin_px_ = low[along];
    cell_begin_px_ = low[1 - along];
    strips_ = cells(along, kStripPx, strip_px_);
    cells_ = cells(1 - along, kCellPx, cell_px_);
    sort(points);
  }

  /// Calls visit(point, point index) for all points within `margin_px` of the line l . (x, y, 1) =
  /// 0, and some others near it. The line must be nearer to the axis `along`.
  template <typename Visit>
  void visit_line(const Eigen::Vector3d& line, double margin_px, const Visit& visit) const {
    const double slope = -line[along_] / line[1 - along_];
    const double offset = -line.z() / line[1 - along_];
    if (!std::isfinite(slope) || !std::isfinite(offset)) {
      return;
    }
    const double margin =
        margin_px * std::sqrt(1.0 + slope * slope) + 0.5 * std::abs(slope) * strip_px_;
    const double step = slope * strip_px_ / cell_px_;
    const double half = margin / cell_px_;
    double middle =
        (slope * (strip_begin_px_ + 0.5 * strip_px_) + offset - cell_begin_px_) / cell_px_;
    for (int strip = 0; strip < strips_; ++strip, middle += step) {
      if (middle + half < 0.0 || middle - half >= cells_) {
        continue;
      }
      const int low = std::max(0, static_cast<int>(middle - half));
      const int high = std::min(cells_ - 1, static_cast<int>(middle + half));
      const std::size_t row = static_cast<std::size_t>(strip) * static_cast<std::size_t>(cells_);
      const std::uint32_t end = starts_[row + static_cast<std::size_t>(high) + 1];
      for (std::uint32_t k = starts_[row + static_cast<std::size_t>(low)]; k < end; ++k) {
        visit(points_[k], members_[k]);
      }
    }
  }

 private:
  static constexpr double kStripPx = 32.0;
  static constexpr double kCellPx = 8.0;
  static constexpr double kMostCells = 512.0;

  [[nodiscard]] std::size_t cell_of(const Eigen::Vector2d& point) const {
    const int strip =
        std::clamp(static_cast<int>((point[along_] - strip_begin_px_) / strip_px_), 0, strips_ - 1);
    const int cell = std::clamp(
        static_cast<int>((point[1 - along_] - cell_begin_px_) / cell_px_), 0, cells_ - 1);
    return static_cast<std::size_t>(strip) * static_cast<std::size_t>(cells_) +
           static_cast<std::size_t>(cell);
  }

  /// Counting sort.
  void sort(std::span<const Eigen::Vector2d> points) {
    starts_.assign(static_cast<std::size_t>(strips_) * static_cast<std::size_t>(cells_) + 1, 0);
    for (const Eigen::Vector2d& point : points) {
      if (point.allFinite()) {
        ++starts_[cell_of(point) + 1];
      }
    }
    for (std::size_t c = 1; c < starts_.size(); ++c) {
      starts_[c] += starts_[c - 1];
    }
    members_.resize(starts_.back());
    points_.resize(starts_.back());
    std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i].allFinite()) {
        const std::uint32_t place = next[cell_of(points[i])]++;
        members_[place] = static_cast<std::uint32_t>(i);
        points_[place] = points[i];
      }
    }
  }

  int along_ = 0;
  double strip_begin_px_ = 0.0;
  double cell_begin_px_ = 0.0;
  double strip_px_ = kStripPx;
  double cell_px_ = kCellPx;
  int strips_ = 0;
  int cells_ = 0;
  std::vector<std::uint32_t> starts_;
  std::vector<std::uint32_t> members_;
  std::vector<Eigen::Vector2d> points_;
};

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
  const PointStrips strips[2] = {PointStrips(second.points_px, 0),
                                 PointStrips(second.points_px, 1)};
  const double limit = max_error_px * max_error_px;
  GuidedScan scan{.rows = std::vector<NearestTwo>(first.index.size()),
                  .columns = std::vector<NearestTwo>(second.index.size())};
  // One place more than points: the place after the last is written too.
  std::vector<std::uint32_t> candidates(second.index.size() + 1);
  std::vector<double> squared_errors(second.index.size() + 1);
  std::vector<std::int32_t> scores(second.index.size());
  for (std::size_t i = 0; i < first.index.size(); ++i) {
    const Eigen::Vector2d& point = first.points_px[i];
    if (!point.allFinite()) {
      continue;
    }
    const Eigen::Vector3d line = fundamental * point.homogeneous();
    const double line_limit = limit * line.head<2>().squaredNorm();
    const Eigen::Matrix2d back = fundamental.topLeftCorner<2, 2>().transpose();
    const Eigen::Vector2d back_offset = fundamental.row(2).head<2>().transpose();
    // Both tests write first and count after, without a branch that could not be predicted.
    std::size_t near_line = 0;
    const int along = std::abs(line.y()) >= std::abs(line.x()) ? 0 : 1;
    strips[along].visit_line(
        line, max_error_px, [&](const Eigen::Vector2d& other, std::uint32_t j) {
          const double error = line.x() * other.x() + line.y() * other.y() + line.z();
          candidates[near_line] = j;
          squared_errors[near_line] = error * error;
          near_line += static_cast<std::size_t>(error * error <= line_limit);
        });
    std::size_t count = 0;
    for (std::size_t c = 0; c < near_line; ++c) {
      const Eigen::Vector2d gradient = back * second.points_px[candidates[c]] + back_offset;
      candidates[count] = candidates[c];
      count += static_cast<std::size_t>(squared_errors[c] <= limit * gradient.squaredNorm());
    }
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
