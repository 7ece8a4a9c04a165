#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace trigmesh {

using Quad = std::array<Eigen::Vector2d, 4>;

/// Value between pixels by bilinear interpolation; positions outside the image take the border's
/// value. `image`: CV_8UC1 or CV_32FC1, at least 2x2.
[[nodiscard]] double sample_bilinear(const cv::Mat& image, const Eigen::Vector2d& pixel);

/// How grey values follow from light.
enum class ToneCurve {
  kSrgb,    ///< photographs as cameras write them (IEC 61966-2-1)
  kLinear,  ///< machine vision cameras without a tone curve
};

/// Light, 0..255, CV_32FC1, of an 8-bit grey image. A blurred edge is symmetric in light only: in
/// sRGB values its steepest place lies about a quarter of a pixel on the dark side.
[[nodiscard]] cv::Mat linear_light(const cv::Mat& grey, ToneCurve curve);

/// Distance along `outward` (unit, from dark to light) from `start` to the centre of the steepest
/// rise within `half_length_px`, pixels; nothing when there is no clear one. `light` as below.
[[nodiscard]] std::optional<double> edge_offset(const cv::Mat& light,
                                                const Eigen::Vector2d& start,
                                                const Eigen::Vector2d& outward,
                                                double half_length_px);

/// Moves the corners of a dark quadrilateral on a light background (clockwise as seen, roughly
/// right to about two pixels) to the meeting points of straight lines through its sides: along each
/// side the place of the steepest rise across it is measured to a fraction of a pixel, and a line
/// fitted with outliers put aside. Nothing when a side has too few clear edge points, or when a
/// corner would move by more than 4 px. `light`: CV_32FC1, 0..255.
[[nodiscard]] std::optional<Quad> refine_dark_quad(const cv::Mat& light, const Quad& quad);

}  // namespace trigmesh
