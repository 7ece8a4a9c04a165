#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

/// The inner loop of PatchMatch: how well a small plane through one reference pixel explains the
/// source pictures. Compiled for several instruction sets and chosen at run time (Highway).
///
/// A plane is kept as the inverse depth that it gives to the pixels around the reference pixel p0:
/// 1/z(p0 + d) = q + a dx + b dy, which is affine in the pixel for every plane. With
/// A = K_s R K_r^-1 and e = K_s t a reference pixel p lands in the source at A p + e (1/z(p)),
/// homogeneous, so that the homography of the plane is a rank-one update of A.
namespace trigmesh {

/// Samples of one patch: whole vectors of every instruction set.
inline constexpr std::size_t kPatchSampleCount = 32;
/// Pixels of a source picture at most: indices are computed as float.
inline constexpr std::int64_t kMaxSourcePixels = std::int64_t{1} << 24;
/// The cost of a plane that a source picture cannot judge: behind it, or outside.
inline constexpr float kNoMatchCost = 2.0F;

/// A plane at a pixel: inverse depth there (1 / scene unit), its growth per pixel to the right and
/// downwards.
struct PlaneHypothesis {
  float inverse_depth = 0.0F;
  float slope_x = 0.0F;
  float slope_y = 0.0F;

  bool operator==(const PlaneHypothesis&) const = default;
};

/// What the reference picture gives to the comparison, once per pixel.
struct ReferencePatch {
  alignas(64) std::array<float, kPatchSampleCount> offset_x_px{};
  alignas(64) std::array<float, kPatchSampleCount> offset_y_px{};
  /// Bilateral weights; their sum is 1. Unused samples have 0.
  alignas(64) std::array<float, kPatchSampleCount> weight{};
  /// weight * (grey - weighted mean of grey).
  alignas(64) std::array<float, kPatchSampleCount> weighted_deviation{};
  float variance = 0.0F;  ///< weighted, grey levels squared
};

/// Where the pixels around one reference pixel land in one source picture.
struct SourceProjection {
  /// width x height: the pixel, its right, lower and lower right neighbour in bits 0-7, 8-15,
  /// 16-23, 24-31; repeated at the edges.
  const std::uint32_t* quads = nullptr;
  std::int32_t stride = 0;  ///< entries of `quads` from row to row
  float max_x_px = 0.0F;    ///< width - 1
  float max_y_px = 0.0F;
  std::array<float, 3> base{};      ///< A p0
  std::array<float, 3> column_x{};  ///< A (1, 0, 0)
  std::array<float, 3> column_y{};  ///< A (0, 1, 0)
  std::array<float, 3> epipole{};   ///< e
};

/// costs[h * sources.size() + s] = 1 - NCC of hypothesis h in source s, in [0, 2]: 0 is a perfect
/// match, 1 none at all; kNoMatchCost where the plane's centre is behind or outside of the source.
/// A noise variance is added to both variances, so that plain areas do not match by chance.
void match_costs(const ReferencePatch& patch,
                 std::span<const SourceProjection> sources,
                 std::span<const PlaneHypothesis> hypotheses,
                 std::span<float> costs);

/// The same by plain loops in double precision: the oracle of the tests.
void match_costs_reference(const ReferencePatch& patch,
                           std::span<const SourceProjection> sources,
                           std::span<const PlaneHypothesis> hypotheses,
                           std::span<float> costs);

}  // namespace trigmesh
