#pragma once

#include <cstddef>
#include <vector>

#include "firmware/base/executor.hpp"
#include "sfm/texture/charts.hpp"
#include "sfm/texture/face_views.hpp"
#include "sfm/texture/view_gains.hpp"

namespace trigmesh {

struct OutlierRejection {
  FaceViews faces;  ///< without the rejected views; quality weighted by agreement
  std::size_t rejected_count = 0;
};

/// Takes out, face by face, views whose (levelled) mean colour there and around disagrees with most
/// of the others: somebody walked through, a highlight, a face that the mesh has in the wrong
/// place. A Gaussian is fitted to the colours and views outside of it are dropped, until nothing
/// changes. Faces that fewer than four views see, and faces whose views form no majority, keep all
/// their views.
[[nodiscard]] OutlierRejection reject_color_outliers(const FaceViews& faces,
                                                     const FaceNeighbors& neighbors,
                                                     const std::vector<ColorGain>& gains,
                                                     Executor& executor);

}  // namespace trigmesh
