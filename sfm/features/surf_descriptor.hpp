#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "sfm/features/features.hpp"
#include "sfm/features/integral_image.hpp"

namespace trigmesh {

inline constexpr int kSurfDescriptorLength = 64;
using SurfVector = std::array<float, kSurfDescriptorLength>;

/// Direction of the strongest Haar-wavelet response around a keypoint (Bay et al. 2008,
/// section 4.1), radians from the x axis towards the y axis, (-pi, pi]; 0 when the neighbourhood is
/// flat or the image too small for any wavelet.
[[nodiscard]] float surf_orientation(const IntegralImage& integral, const Keypoint& keypoint);

/// Descriptor in its own frame, turned by `keypoint.angle_rad` (0: upright): 4x4 subregions of a
/// window of side 20 scale_px, row by row; each with four non-negative sums of 5x5 Haar responses:
/// dx > 0, dx < 0 (as |dx|), dy > 0, dy < 0. Of unit length, or all zero where the image is flat.
///
/// The paper stores (sum dx, sum |dx|, sum dy, sum |dy|). With p and n the sums of the positive and
/// the negative part, sum dx = p - n and sum |dx| = p + n: (p, n) is the paper's pair turned by 45
/// degrees and divided by sqrt(2). Distances, norms and dot products between normalised descriptors
/// are therefore those of the paper, without a negative number.
[[nodiscard]] SurfVector surf_descriptor(const IntegralImage& integral, const Keypoint& keypoint);

/// Bytes for the dot-product matcher: the unit vector times 256, rounded, at most 127; when a
/// component is cut at 127 the others are enlarged so that the length stays 256 (a window with
/// fewer than five non-zero components cannot reach it). With equal lengths, a larger dot product
/// means a smaller distance.
void quantize_surf(const SurfVector& descriptor,
                   std::span<std::uint8_t, kSurfDescriptorLength> bytes);

}  // namespace trigmesh
