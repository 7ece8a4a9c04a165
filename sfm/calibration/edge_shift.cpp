// All edges of a marker are seen d pixels too far on their dark side. Its dark square then seems
// 2 d smaller, and a place predicted from it at the part u of the way from one side to the other is
// moved by d (1 - 2 u). An edge there whose light side lies in the direction l = +1 or -1 of that
// way is itself moved by -d l; so from the prediction towards the light it is found at
//
//   m = -d (1 + l (1 - 2 u)).
//
// d is what all edges inside of the markers say by least squares, outliers put aside.
#include "sfm/calibration/edge_shift.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace trigmesh {
namespace {

constexpr double kMinCellPx = 3.0;
constexpr double kFarthestLookPx = 3.0;
constexpr double kFarFromMedianPx = 0.25;
constexpr std::size_t kMinEdges = 24;
constexpr double kLargestShiftPx = 0.5;
constexpr std::array kAlongCell{0.35, 0.5, 0.65};  ///< where on an edge it is measured

/// An edge place: how far it was found towards the light, and the factor in front of -d.
struct EdgePlace {
  double found_px = 0.0;
  double factor = 0.0;

  [[nodiscard]] double shift_px() const { return -found_px / factor; }
};

double shortest_side_px(const Quad& quad) {
  double shortest = (quad[0] - quad[3]).norm();
  for (std::size_t i = 0; i + 1 < quad.size(); ++i) {
    shortest = std::min(shortest, (quad[i + 1] - quad[i]).norm());
  }
  return shortest;
}

/// Cells of a marker with its black frame.
class Cells {
 public:
  explicit Cells(const ReadMarker& marker)
      : marker_(marker),
        count_(marker.bits + 2),
        cell_px_(shortest_side_px(marker.quad) / (marker.bits + 2)) {
    const auto side = static_cast<float>(count_);
    const std::array<cv::Point2f, 4> from{cv::Point2f{0, 0}, {side, 0}, {side, side}, {0, side}};
    std::array<cv::Point2f, 4> to;
    std::transform(
        marker.quad.begin(), marker.quad.end(), to.begin(), [](const Eigen::Vector2d& p) {
          return cv::Point2f(static_cast<float>(p.x()), static_cast<float>(p.y()));
        });
    image_from_cells_ = cv::getPerspectiveTransform(from.data(), to.data());
  }

  [[nodiscard]] int count() const { return count_; }

  [[nodiscard]] double cell_px() const { return cell_px_; }

  /// How far to look for an edge, so that the next one is not found.
  [[nodiscard]] double half_cell_px() const { return std::min(0.5 * cell_px_, kFarthestLookPx); }

  [[nodiscard]] bool is_white(int column, int row) const {
    const int bits = marker_.bits;
    if (column < 1 || row < 1 || column > bits || row > bits) {
      return false;
    }
    const int place = bits * bits - 1 - ((row - 1) * bits + column - 1);
    return ((marker_.pattern >> static_cast<unsigned>(place)) & 1U) != 0;
  }

  [[nodiscard]] Eigen::Vector2d in_image(const Eigen::Vector2d& cell) const {
    const cv::Vec3d p = image_from_cells_ * cv::Vec3d(cell.x(), cell.y(), 1.0);
    return {p[0] / p[2], p[1] / p[2]};
  }

 private:
  const ReadMarker& marker_;
  int count_;
  double cell_px_;
  cv::Matx33d image_from_cells_;
};

/// Measures the edge between a cell and the next along `axis` (0: to the right, 1: down).
void add_edge(const cv::Mat& light,
              const Cells& cells,
              const Eigen::Vector2i& cell,
              int axis,
              std::vector<EdgePlace>& places) {
  const Eigen::Vector2i step = axis == 0 ? Eigen::Vector2i(1, 0) : Eigen::Vector2i(0, 1);
  const Eigen::Vector2i next = cell + step;
  const bool light_is_next = cells.is_white(next.x(), next.y());
  if (light_is_next == cells.is_white(cell.x(), cell.y())) {
    return;
  }
  const double towards_light = light_is_next ? 1.0 : -1.0;
  const double part = static_cast<double>(next[axis]) / cells.count();
  for (const double along : kAlongCell) {
    Eigen::Vector2d place = next.cast<double>();
    place[1 - axis] += along;
    const Eigen::Vector2d here = cells.in_image(place);
    const Eigen::Vector2d edge =
        cells.in_image(place + 0.1 * Eigen::Vector2d(step.y(), step.x())) - here;
    const Eigen::Vector2d across =
        cells.in_image(place + 0.1 * towards_light * step.cast<double>()) - here;
    Eigen::Vector2d normal = Eigen::Vector2d(edge.y(), -edge.x()).normalized();
    normal *= normal.dot(across) < 0.0 ? -1.0 : 1.0;
    if (const auto found = edge_offset(light, here, normal, cells.half_cell_px())) {
      places.push_back({*found, 1.0 + towards_light * (1.0 - 2.0 * part)});
    }
  }
}

std::vector<EdgePlace> edges_inside(const cv::Mat& light, const ReadMarker& marker) {
  std::vector<EdgePlace> places;
  const Cells cells(marker);
  if (cells.cell_px() < kMinCellPx) {
    return places;
  }
  for (int row = 0; row + 1 < cells.count(); ++row) {
    for (int column = 0; column + 1 < cells.count(); ++column) {
      add_edge(light, cells, {column, row}, 0, places);
      add_edge(light, cells, {column, row}, 1, places);
    }
  }
  return places;
}

double median_shift(const std::vector<EdgePlace>& places) {
  std::vector<double> shifts;
  for (const EdgePlace& place : places) {
    shifts.push_back(place.shift_px());
  }
  const auto middle = shifts.begin() + std::ssize(shifts) / 2;
  std::nth_element(shifts.begin(), middle, shifts.end());
  return *middle;
}

}  // namespace

std::optional<double> edge_shift_px(const cv::Mat& light, const std::vector<ReadMarker>& markers) {
  std::vector<EdgePlace> places;
  for (const ReadMarker& marker : markers) {
    const std::vector<EdgePlace> more = edges_inside(light, marker);
    places.insert(places.end(), more.begin(), more.end());
  }
  if (places.size() < kMinEdges) {
    return std::nullopt;
  }
  const double median = median_shift(places);
  double moment = 0.0;
  double weight = 0.0;
  for (const EdgePlace& place : places) {
    if (std::abs(place.shift_px() - median) < kFarFromMedianPx / place.factor) {
      moment -= place.factor * place.found_px;
      weight += place.factor * place.factor;
    }
  }
  const double shift = moment / weight;
  return std::abs(shift) <= kLargestShiftPx ? std::optional(shift) : std::nullopt;
}

Quad moved_outwards(const Quad& quad, double by_px) {
  std::array<Eigen::Vector2d, 4> along;
  for (std::size_t i = 0; i < 4; ++i) {
    along[i] = (quad[(i + 1) % 4] - quad[i]).normalized();
  }
  Quad moved;
  for (std::size_t i = 0; i < 4; ++i) {
    // Against the way to both neighbours, so far that the distance to both sides grows by `by_px`.
    const Eigen::Vector2d& before = along[(i + 3) % 4];
    const Eigen::Vector2d& after = along[i];
    const double sine = before.x() * after.y() - before.y() * after.x();
    moved[i] = quad[i] + by_px / sine * (before - after);
  }
  return moved;
}

}  // namespace trigmesh
