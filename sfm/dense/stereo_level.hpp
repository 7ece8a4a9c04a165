#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "sfm/camera/camera.hpp"
#include "sfm/dense/patch_match.hpp"
#include "sfm/dense/patch_match_kernel.hpp"

namespace trigmesh {

/// A source picture at one resolution, ready for the kernel.
struct StereoSource {
  cv::Mat quads;                  ///< CV_32SC1, see SourceProjection
  Eigen::Matrix3f rotation;       ///< A: source pixel ~ A p + e / z(p)
  Eigen::Vector3f epipole;        ///< e
  Eigen::Matrix3f back_rotation;  ///< the same from the source to the reference
  Eigen::Vector3f back_epipole;
  cv::Mat inverse_depth;  ///< CV_32FC1 of the source's map, 0 = not known; or empty
};

/// One resolution of a stereo problem.
struct StereoLevel {
  Camera camera;  ///< of the reference
  cv::Mat grey;   ///< CV_8UC1
  cv::Mat mask;   ///< CV_8UC1 or empty
  std::vector<StereoSource> sources;

  /// The projection of the surroundings of a reference pixel into source `s`.
  [[nodiscard]] SourceProjection project(std::size_t s, float x, float y) const;
};

/// The pictures of a problem at `1 / 2^halvings` of their size.
[[nodiscard]] StereoLevel make_stereo_level(const StereoProblem& problem, int halvings);

/// How far, in reference pixels, a point at inverse depth `q` of a reference pixel lands from that
/// pixel when it goes to the source and comes back from the surface that the source's map has
/// there. Nothing when the point is outside of the source or the source knows no depth there.
[[nodiscard]] std::optional<float> round_trip_error_px(const StereoSource& source,
                                                       float x,
                                                       float y,
                                                       float q);

}  // namespace trigmesh
