#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "firmware/base/result.hpp"
#include "sfm/keyframes/image_pyramid.hpp"

namespace trigmesh {

/// How corners are found and followed. All lengths are pixels of the image that is given.
struct CornerTrackerOptions {
  int max_corners = 160;              ///< [8, 2000]
  double min_corner_strength = 0.01;  ///< of the strongest corner, (0, 1)
  double min_distance_px = 10.0;      ///< between two corners, [1, 200]
  int patch_radius_px = 7;            ///< a patch has 2 r + 1 pixels a side, [2, 15]
  int levels = 3;                 ///< of the pyramid, each half the size of the one below, [1, 6]
  int max_iterations = 12;        ///< a level, [1, 100]
  double max_roundtrip_px = 0.7;  ///< there and back again, > 0
  double min_patch_correlation = 0.8;  ///< of the grey values in both images, [-1, 1]

  [[nodiscard]] Result<> validate() const;
};

/// Corners worth following: the smaller eigenvalue of the gradients' second moments is large
/// (Shi and Tomasi, "Good Features to Track", CVPR 1994). Strongest first. Pixels of `grey`,
/// CV_8UC1. Precondition: valid options.
[[nodiscard]] std::vector<Eigen::Vector2f> find_corners(const cv::Mat& grey,
                                                        const CornerTrackerOptions& options);

/// Where a corner of the first image lies in the second: translation of a patch, coarse to fine
/// (Lucas and Kanade, "An Iterative Image Registration Technique", IJCAI 1981, in the inverse
/// compositional form of Baker and Matthews, IJCV 2004, on patches of equal mean and contrast).
/// Nothing where the patch leaves the image, does not look alike, or tracked back ends elsewhere.
[[nodiscard]] std::optional<Eigen::Vector2f> track_corner(const ImagePyramid& first,
                                                          const ImagePyramid& second,
                                                          const Eigen::Vector2f& corner,
                                                          const CornerTrackerOptions& options);

}  // namespace trigmesh
