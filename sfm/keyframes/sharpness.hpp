#pragma once

#include <opencv2/core/mat.hpp>

namespace trigmesh {

/// How sharp an image is, to compare images of one scene: the variance of the Laplacian of its 4
/// neighbours, grey levels squared (Pech-Pacheco et al., "Diatom autofocusing in brightfield
/// microscopy", ICPR 2000). 0: no edge at all, or fewer than 3 pixels on a side. `grey`: CV_8UC1.
[[nodiscard]] double variance_of_laplacian(const cv::Mat& grey);

}  // namespace trigmesh
