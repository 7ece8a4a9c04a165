#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "sfm/features/sift_scale_space.hpp"

/// Orientations and descriptors from the Gaussian level nearest to a keypoint. Both sample the
/// level on a small grid that is tied to the keypoint (centre with its subpixel part, spacing 0.75
/// sigma, for descriptors turned by its orientation): a level of blur sigma holds nothing finer, so
/// the grid has all the information of the several thousand pixels below it at a tenth of the cost,
/// and every weight of the histograms is a constant.
namespace trigmesh::sift {

inline constexpr int kDescriptorLength = 128;
inline constexpr int kMaxOrientations = 2;

/// A place in a level, pixels of the octave.
struct PatchCentre {
  float x_px = 0.0F;
  float y_px = 0.0F;
  float sigma_px = 0.0F;
};

/// Orientations of one keypoint, strongest first; radians in (-pi, pi], x axis towards y axis.
struct Orientations {
  std::array<float, kMaxOrientations> angle_rad{};
  int count = 0;
};

/// The peaks of the smoothed histogram of gradient directions (36 bins, Gaussian window of 1.5
/// sigma) that reach 0.8 of the highest (Lowe 2004, section 5). A patch without gradient has none.
[[nodiscard]] Orientations find_orientations(const LevelView& level, const PatchCentre& centre);

/// The 4x4x8 histogram of Lowe 2004, section 6, with trilinear weights, cells of 3 sigma, entries
/// clamped at 0.2; then RootSIFT: square roots of the L1-normalised entries (Arandjelovic and
/// Zisserman, "Three things everyone should know to improve object retrieval", CVPR 2012), as bytes
/// round(256 v) clamped at 127. All zero for a patch without gradient.
void describe(const LevelView& level,
              const PatchCentre& centre,
              float angle_rad,
              std::span<std::uint8_t, kDescriptorLength> out);

}  // namespace trigmesh::sift
