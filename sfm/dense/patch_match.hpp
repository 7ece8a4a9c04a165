#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

/// The most source views that one depth map can use.
inline constexpr std::size_t kMaxStereoSources = 8;

/// A picture at the size of the depth maps.
struct StereoImage {
  cv::Mat grey;   ///< CV_8UC1
  cv::Mat mask;   ///< CV_8UC1 of the same size, 0 = leave out; or empty: all count
  Camera camera;  ///< kPinhole, of the size of `grey`
  Rigid3 cam_from_world;
};

/// What is needed to estimate the depth map of one view.
struct StereoProblem {
  StereoImage reference;
  std::vector<StereoImage> sources;  ///< 1 to kMaxStereoSources, best first
  /// Sparse points in the reference camera frame, scene units; may be empty.
  std::vector<Eigen::Vector3f> seeds_in_cam;
  float min_depth = 0.0F;  ///< surfaces are looked for between these, scene units, 0 < min < max
  float max_depth = 0.0F;

  /// For a geometric round: the maps of the sources from the round before, at any size, or empty
  /// mats; as many as sources. Empty for the first, photometric round.
  std::vector<DepthMap> source_maps;
  /// For a geometric round: the map of the reference from the round before, at any size: a first
  /// round at half the size costs a quarter. Empty mats otherwise.
  DepthMap initial;
};

/// How PatchMatch searches. The defaults are the preset `standard`.
struct PatchMatchOptions {
  /// Image sizes, each half of the one before; [1, 6]. Fewer are used for small images.
  int levels = 3;
  /// Sweeps at the coarsest size, [1, 32].
  int coarse_iterations = 5;
  /// Sweeps at each size in between, [1, 32].
  int middle_iterations = 3;
  /// Sweeps at the full size, [1, 32].
  int fine_iterations = 2;
  /// Sweeps of a geometric round (full size only), [1, 32].
  int geometric_iterations = 1;
  /// Cost of a disagreement of 1 px with the map of a source, [0, 1]; X. Xu and W. Tao,
  /// "Multi-scale geometric consistency guided multi-view stereo", CVPR 2019, use 0.2.
  float geometric_weight = 0.1F;
  /// Decay of the bilateral weight by grey difference, grey levels, (0, 255].
  float grey_sigma = 12.0F;
  /// For all random numbers: the same seed gives the same map.
  std::uint64_t seed = 1;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

/// Depth, normals and a photometric confidence for every pixel of the reference picture that its
/// mask leaves in; unfiltered: wrong where nothing can be matched (see depth_filter.hpp). A problem
/// with `initial` is a geometric round: hypotheses of the sources' maps are tried too and
/// disagreement with them costs. The same input gives the same bytes whatever the executor.
/// kInvalidArgument: options, sizes or depth range that break the rules above.
[[nodiscard]] Result<DepthMap> estimate_depth_map(const StereoProblem& problem,
                                                  const PatchMatchOptions& options,
                                                  Executor& executor);

/// Bytes that one call of estimate_depth_map takes at most beside its input, output included.
[[nodiscard]] std::size_t estimate_memory_bytes(int width_px, int height_px, std::size_t sources);

}  // namespace trigmesh
