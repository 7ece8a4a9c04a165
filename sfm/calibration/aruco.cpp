// Square fiducial markers, in the manner of S. Garrido-Jurado, R. Munoz-Salinas, F. Madrid-Cuevas,
// M. Marin-Jimenez, "Automatic generation and detection of highly reliable fiducial markers under
// occlusion", Pattern Recognition 47(6), 2014: local threshold -> contours -> quadrilaterals ->
// cells read through a homography -> dictionary; then our own corner refinement.
#include "sfm/calibration/aruco.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "sfm/calibration/edge_shift.hpp"

namespace trigmesh {
namespace {

constexpr double kThresholdOffset = 7.0;  ///< grey levels below the local mean that count as dark
constexpr double kPolygonTolerance = 0.035;    ///< of the contour's length
constexpr int kSamplesPerCell = 4;             ///< along one side, in the middle part of the cell
constexpr double kCellMargin = 0.22;           ///< of a cell, left out on each side
constexpr double kMaxWrongFrame_ratio = 0.15;  ///< of the frame's cells that may read white

/// Sides of the threshold windows, pixels: small ones separate small markers, large ones fill large
/// ones.
std::vector<int> window_sides(const cv::Mat& grey) {
  std::vector<int> sides;
  const int largest = std::max(15, std::min(grey.cols, grey.rows) / 8);
  for (int side = 9; side <= largest; side = 2 * side + 5) {
    sides.push_back(side | 1);
  }
  return sides;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Four corners clockwise as seen (y down), or nothing when the contour is no convex quadrilateral
/// of useful size.
std::optional<Quad> quad_from_contour(const std::vector<cv::Point>& contour, double min_side_px) {
  if (static_cast<double>(contour.size()) < 3.0 * min_side_px) {
    return std::nullopt;
  }
  std::vector<cv::Point> polygon;
  cv::approxPolyDP(contour, polygon, kPolygonTolerance * static_cast<double>(contour.size()), true);
  if (polygon.size() != 4 || !cv::isContourConvex(polygon)) {
    return std::nullopt;
  }
  Quad quad;
  for (std::size_t i = 0; i < 4; ++i) {
    quad[i] = {static_cast<double>(polygon[i].x), static_cast<double>(polygon[i].y)};
  }
  if (cross(quad[1] - quad[0], quad[2] - quad[0]) < 0.0) {
    std::swap(quad[1], quad[3]);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    if ((quad[(i + 1) % 4] - quad[i]).norm() < min_side_px) {
      return std::nullopt;
    }
  }
  return quad;
}

/// Maps cells, (0, 0) .. (cells, cells), to the quadrilateral.
cv::Matx33d cells_to_image(const Quad& quad, int cells) {
  const auto side = static_cast<float>(cells);
  const std::array<cv::Point2f, 4> from{cv::Point2f{0, 0}, {side, 0}, {side, side}, {0, side}};
  std::array<cv::Point2f, 4> to;
  std::transform(quad.begin(), quad.end(), to.begin(), [](const Eigen::Vector2d& p) {
    return cv::Point2f(static_cast<float>(p.x()), static_cast<float>(p.y()));
  });
  return cv::getPerspectiveTransform(from.data(), to.data());
}

/// Mean grey value of every cell, frame included, row by row.
std::vector<double> read_cells(const cv::Mat& grey, const Quad& quad, int cells) {
  const cv::Matx33d h = cells_to_image(quad, cells);
  std::vector<double> means;
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      double sum = 0.0;
      for (int i = 0; i < kSamplesPerCell * kSamplesPerCell; ++i) {
        const auto inside = [](int k) {
          return kCellMargin + (1.0 - 2.0 * kCellMargin) * (k + 0.5) / kSamplesPerCell;
        };
        const cv::Vec3d p =
            h *
            cv::Vec3d(column + inside(i % kSamplesPerCell), row + inside(i / kSamplesPerCell), 1.0);
        sum += sample_bilinear(grey, {p[0] / p[2], p[1] / p[2]});
      }
      means.push_back(sum / (kSamplesPerCell * kSamplesPerCell));
    }
  }
  return means;
}

/// The threshold between dark and light that splits the values best (N. Otsu, IEEE SMC 1979), and
/// the distance between the means of the two sides.
struct Split {
  double threshold = 0.0;
  double contrast = 0.0;
};

Split best_split(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double total = 0.0;
  for (const double v : values) {
    total += v;
  }
  Split best;
  double best_variance = -1.0;
  double below = 0.0;
  const auto n = static_cast<double>(values.size());
  for (std::size_t i = 1; i < values.size(); ++i) {
    below += values[i - 1];
    const auto k = static_cast<double>(i);
    const double gap = (total - below) / (n - k) - below / k;
    const double variance = k * (n - k) * gap * gap;
    if (variance > best_variance) {
      best_variance = variance;
      best = {.threshold = 0.5 * (values[i - 1] + values[i]), .contrast = gap};
    }
  }
  return best;
}

/// Bits inside the frame; nothing when the contrast is poor or the frame is not dark.
std::optional<std::uint64_t> read_bits(const cv::Mat& grey,
                                       const Quad& quad,
                                       int bits,
                                       double min_contrast) {
  const int cells = bits + 2;
  const std::vector<double> means = read_cells(grey, quad, cells);
  const Split split = best_split(means);
  if (split.contrast < min_contrast) {
    return std::nullopt;
  }
  std::uint64_t pattern = 0;
  int white_frame = 0;
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      const bool white = means[static_cast<std::size_t>(row * cells + column)] > split.threshold;
      if (row == 0 || column == 0 || row == cells - 1 || column == cells - 1) {
        white_frame += white ? 1 : 0;
      } else {
        pattern = (pattern << 1U) | (white ? 1U : 0U);
      }
    }
  }
  if (white_frame > kMaxWrongFrame_ratio * 4 * (cells - 1)) {
    return std::nullopt;
  }
  return pattern;
}

double area(const Quad& quad) {
  return 0.5 * std::abs(cross(quad[2] - quad[0], quad[3] - quad[1]));
}

/// A marker that was found, and how.
struct FoundMarker {
  ReadMarker read;
  MarkerIdentity identity;
};

/// The marker in a quadrilateral, corners refined where their edges are clear.
std::optional<FoundMarker> identify_quad(const cv::Mat& grey,
                                         const cv::Mat& light,
                                         const Quad& coarse,
                                         const MarkerDictionary& dictionary,
                                         double min_contrast) {
  const Quad quad = refine_dark_quad(light, coarse).value_or(coarse);
  const auto pattern = read_bits(grey, quad, dictionary.bits, min_contrast);
  if (!pattern) {
    return std::nullopt;
  }
  const auto identity = dictionary.identify(*pattern, dictionary.correctable_bits());
  if (!identity) {
    return std::nullopt;
  }
  return FoundMarker{{quad, *pattern, dictionary.bits}, *identity};
}

MarkerDetection detection_of(const FoundMarker& found, double edge_shift_px) {
  const Quad quad = moved_outwards(found.read.quad, edge_shift_px);
  MarkerDetection detection{
      .id = found.identity.id, .corners_px = {}, .wrong_bits = found.identity.wrong_bits};
  for (std::size_t i = 0; i < 4; ++i) {
    // Turned clockwise by n quarters, the marker's top left corner is seen as corner n of the
    // clockwise four.
    detection.corners_px[i] =
        quad[(i + static_cast<std::size_t>(found.identity.quarter_turns)) % 4];
  }
  return detection;
}

/// Of two finds of one marker, whether the second is better: fewer wrong bits, or larger.
bool is_better(const FoundMarker& known, const FoundMarker& found) {
  return found.identity.wrong_bits < known.identity.wrong_bits ||
         area(found.read.quad) > 1.05 * area(known.read.quad);
}

std::vector<MarkerDetection> find_markers(const cv::Mat& grey,
                                          const MarkerDictionary& dictionary,
                                          const MarkerDetectorOptions& options) {
  const cv::Mat light = linear_light(grey, options.tone_curve);
  std::map<int, FoundMarker> by_id;
  for (const int side : window_sides(grey)) {
    cv::Mat dark;
    cv::adaptiveThreshold(
        grey, dark, 255, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY_INV, side, kThresholdOffset);
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(dark, contours, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
    for (const auto& contour : contours) {
      const auto quad = quad_from_contour(contour, options.min_side_px);
      if (!quad) {
        continue;
      }
      const auto found = identify_quad(grey, light, *quad, dictionary, options.min_contrast);
      if (!found) {
        continue;
      }
      // The same marker found through another window is the same; of two different ones the larger
      // is kept.
      const auto [known, is_new] = by_id.emplace(found->identity.id, *found);
      if (!is_new && is_better(known->second, *found)) {
        known->second = *found;
      }
    }
  }
  std::vector<ReadMarker> read;
  for (const auto& [id, found] : by_id) {
    read.push_back(found.read);
  }
  const double shift_px = edge_shift_px(light, read).value_or(0.0);
  std::vector<MarkerDetection> detections;
  for (const auto& [id, found] : by_id) {
    detections.push_back(detection_of(found, shift_px));
  }
  return detections;
}

}  // namespace

Result<> MarkerDetectorOptions::validate() const {
  if (!(min_side_px >= 8.0)) {
    return fail(ErrorCode::kInvalidArgument, "min_side_px is {}, must be at least 8", min_side_px);
  }
  if (!(min_contrast > 0.0 && min_contrast <= 255.0)) {
    return fail(
        ErrorCode::kInvalidArgument, "min_contrast is {}, must be in (0, 255]", min_contrast);
  }
  return {};
}

Result<std::vector<MarkerDetection>> detect_markers(const cv::Mat& grey,
                                                    const MarkerDictionary& dictionary,
                                                    const MarkerDetectorOptions& options) {
  TM_RETURN_IF_ERROR(options.validate());
  if (grey.type() != CV_8UC1 || grey.cols < 16 || grey.rows < 16) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot look for markers: need an 8-bit grey image of at least 16x16, got {}x{} of "
                "OpenCV type {}",
                grey.cols,
                grey.rows,
                grey.type());
  }
  try {
    return find_markers(grey, dictionary, options);
  } catch (const cv::Exception& error) {
    return fail(ErrorCode::kInternal, "cannot look for markers: {}", error.what());
  }
}

}  // namespace trigmesh
