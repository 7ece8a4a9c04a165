#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "sfm/features/sift_rows.hpp"

namespace trigmesh::sift {

inline constexpr int kScalesPerOctave = 3;
inline constexpr int kLevels = kScalesPerOctave + 3;  ///< Gaussian levels in one octave
inline constexpr int kDifferences = kLevels - 1;  ///< difference-of-Gaussian layers in one octave
inline constexpr double kBaseSigma = 1.6;         ///< blur of level 0, pixels of the octave

/// A Gaussian level kept for orientations and descriptors: grey values as fixed point with 8
/// fractional bits.
struct LevelView {
  const std::uint16_t* pixels = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  ///< elements from one row to the next
};

/// A refined extremum of the difference of Gaussians. Positions and sigma in pixels of its octave.
struct Extremum {
  int octave = 0;
  int level = 0;  ///< 1..kScalesPerOctave: the nearest Gaussian level
  float x_px = 0.0F;
  float y_px = 0.0F;
  float sigma_px = 0.0F;
  float response = 0.0F;  ///< |difference of Gaussians| at the refined place, grey values
};

enum class FirstOctave { kInputSize, kDoubleSize };

struct ScaleSpaceOptions {
  FirstOctave first_octave = FirstOctave::kInputSize;
  /// Smallest |difference of Gaussians| of a refined extremum, grey values 0..255, > 0. The default
  /// is COLMAP's 0.02 / 3.
  float min_contrast = 0.02F / 3.0F * 255.0F;
  /// Largest ratio of the principal curvatures (Lowe 2004, section 4.1), > 1.
  float max_edge_ratio = 10.0F;
};

/// One octave: pixel (x, y) lies at (x, y) * pixel_size_px of the input image.
struct Octave {
  int width = 0;
  int height = 0;
  float pixel_size_px = 1.0F;
  std::array<std::vector<std::uint16_t>, kScalesPerOctave> levels;  ///< levels 1..kScalesPerOctave
};

/// The Gaussian scale space of one image and its extrema (Lowe, "Distinctive Image Features from
/// Scale-Invariant Keypoints", IJCV 2004, sections 3 and 4). Only what descriptors need is kept as
/// whole images; everything else lives in ring buffers of rows, strip by strip, so that the working
/// set stays in the second-level cache. The object is a work space: build it again for the next
/// image and no memory is allocated.
class ScaleSpace {
 public:
  /// `grey`: CV_8UC1. Replaces what an earlier call left.
  void build(const cv::Mat& grey, const ScaleSpaceOptions& options);

  /// All extrema, ordered by octave, level, y, x.
  [[nodiscard]] const std::vector<Extremum>& extrema() const { return extrema_; }

  [[nodiscard]] int octave_count() const { return octave_count_; }

  [[nodiscard]] const Octave& octave(int index) const;

  /// `level` in 1..kScalesPerOctave.
  [[nodiscard]] LevelView level(int octave, int level) const;

 private:
  std::vector<Octave> octaves_;
  int octave_count_ = 0;
  std::array<std::vector<float>, 2> bases_;
  std::vector<float> strip_memory_;
  std::vector<Extremum> extrema_;
};

}  // namespace trigmesh::sift
