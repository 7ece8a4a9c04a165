#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/geometry/rigid3.hpp"

namespace trigmesh {

/// The pose of one image, known by its file name.
struct NamedPose {
  std::string name;
  Rigid3 cam_from_world;
};

/// Whether a wrong size of the model counts as an error.
enum class ScaleAlignment {
  kFitted,    ///< a similarity is fitted: the usual score of reconstructions without a scale
  kMeasured,  ///< only a rigid motion is fitted: the model claims to be in the units of the truth
};

/// How far estimated camera poses are from the true ones.
struct PoseEvaluation {
  std::size_t truth_count = 0;  ///< images with a true pose
  std::size_t registered = 0;   ///< of these, with an estimated pose
  double position_rmse = 0.0;   ///< of camera centres after alignment, in units of the truth
  double position_median = 0.0;
  double position_max = 0.0;
  double rotation_median_deg = 0.0;  ///< of the rotations after alignment
  double auc_1_deg = 0.0;            ///< recall_area of relative pose errors up to 1 degree, [0, 1]
  double auc_3_deg = 0.0;
  double auc_5_deg = 0.0;
};

/// Compares the poses of images that are in both lists. Names are paired without folder and
/// extension, or, when that is ambiguous in one list, in full. Centres are compared after the
/// least-squares motion that carries the estimated ones onto the true ones (Umeyama, "Least-squares
/// estimation of transformation parameters between two point patterns", PAMI 1991). The AUC is over
/// all pairs of true images; a pair with an unregistered image counts as infinitely wrong.
/// kInsufficientData when fewer than three images are in both or their centres lie on one line;
/// kInvalidArgument when an image stands twice in one list. O(n^2) in the number of images.
[[nodiscard]] Result<PoseEvaluation> evaluate_poses(std::span<const NamedPose> truth,
                                                    std::span<const NamedPose> estimate,
                                                    ScaleAlignment scale);

/// Area under the recall curve of the errors up to a limit, divided by the limit: 1 when all are
/// zero, 0 when all are at least the limit. The curve is the piecewise linear one through (e_i,
/// i/n) of the sorted errors, as in the evaluation of SuperGlue (Sarlin et al., CVPR 2020). 0 for
/// no errors.
[[nodiscard]] double recall_area(std::vector<double> errors, double limit);

}  // namespace trigmesh
