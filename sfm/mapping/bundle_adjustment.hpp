#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/scene/ids.hpp"
#include "sfm/scene/scene.hpp"

// Bundle adjustment: the poses P_i, points X_j and intrinsics K_c that minimise
//
//   sum over observations (i, j) of rho(|project(K_c(i), P_i X_j) - x_ij|^2 / sigma_ij^2) +
//   priors(K_c)
//
// B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle Adjustment - A Modern Synthesis",
// Vision Algorithms 1999.

namespace trigmesh {

/// How large residuals are kept from ruling. With r = |residual| / sigma and s = `loss_scale_px`,
/// the cost is half of:
enum class RobustLoss {
  kNone,    ///< r^2
  kHuber,   ///< r^2 up to s, then linear
  kSoftL1,  ///< 2 s^2 (sqrt(1 + r^2/s^2) - 1)
  kCauchy,  ///< s^2 log(1 + r^2/s^2): far outliers lose all pull
};

/// Which code solves. Both minimise the same cost; results differ by rounding and by the last step
/// taken.
enum class BundleSolver {
  kAutomatic,  ///< kSchur up to `dense_views`, kCeres beyond
  kSchur,      ///< our own: dense reduced system, several threads if the executor has them
  kCeres,      ///< Ceres: reduced system dense up to `dense_views`, sparse beyond; one thread
};

/// What is solved of the intrinsics of one camera, and what was known before. fy follows fx in its
/// present ratio.
struct IntrinsicsFreedom {
  bool focal = false;
  bool principal_point = false;
  /// How many of the leading entries of `Camera::distortion` are solved, [0, 4]; at most those of
  /// the model.
  int distortion = 0;

  /// Gaussian priors around `prior`, each 0 for none. They count against residuals in units of
  /// their sigma.
  double focal_sigma_ratio = 0.0;         ///< of prior.fx_px
  double principal_point_sigma_px = 0.0;  ///< of each coordinate
  double distortion_sigma = 0.0;          ///< of each entry
  Camera prior{};                         ///< read only where a sigma is not 0

  [[nodiscard]] bool anything() const { return focal || principal_point || distortion > 0; }
};

/// Settings of one adjustment.
struct BundleOptions {
  BundleSolver solver = BundleSolver::kAutomatic;
  RobustLoss loss = RobustLoss::kSoftL1;
  /// Where the loss leaves the parabola, in pixels of an observation with sigma 1, > 0.
  double loss_scale_px = 1.0;
  /// Most trust region steps tried, >= 1.
  int max_iterations = 50;
  /// Converged when a step lowers the cost by less than this ratio, >= 0.
  double function_tolerance = 1e-6;
  /// Converged when a step is shorter than this ratio of the parameters, >= 0.
  double parameter_tolerance = 1e-8;
  /// Up to this many variable views the reduced camera system is solved dense, beyond it sparse, >=
  /// 0.
  int dense_views = 200;
  /// By CameraId; cameras beyond the end are fixed.
  std::vector<IntrinsicsFreedom> intrinsics;

  [[nodiscard]] Result<> validate() const;
};

/// Whether the landmarks move. Held, the adjustment refines poses (and intrinsics) against a fixed
/// cloud.
enum class LandmarkMode { kVariable, kConstant };

/// Which part of the scene is adjusted. Only observations of `landmarks` by `variable_views` and
/// `constant_views` are used. Every view named must have a pose; no view stands in both lists.
/// Order and repetition do not matter.
struct BundleSelection {
  std::vector<ViewId> variable_views;
  std::vector<ViewId> constant_views;
  std::vector<LandmarkId> landmarks;
  LandmarkMode landmark_mode = LandmarkMode::kVariable;
};

/// All registered views and all landmarks.
[[nodiscard]] BundleSelection select_everything(const Scene& scene);

/// The given registered views, every landmark that they see, and as constant all other registered
/// views that see at least `min_shared` of these landmarks. At least one constant view is kept
/// whenever another view shares a landmark.
[[nodiscard]] BundleSelection select_around(const Scene& scene,
                                            std::span<const ViewId> variable_views,
                                            std::size_t min_shared = 1);

/// How an adjustment ended. In every case but kFailed the scene is at least as good as before, in
/// terms of the cost.
enum class BundleOutcome {
  kConverged,
  kMaxIterations,  ///< still improving when the limit was reached; the scene has the best state
                   ///< found
  kFailed,         ///< no finite solution; the scene is as it was
  kNothingToDo,    ///< no usable observation, or nothing variable; the scene is as it was
};

/// "converged", "max_iterations", "failed", "nothing_to_do".
[[nodiscard]] std::string_view to_string(BundleOutcome outcome);

/// What an adjustment did.
struct BundleReport {
  BundleOutcome outcome = BundleOutcome::kNothingToDo;
  std::size_t observations = 0;  ///< used
  /// Not used: behind the camera or beyond its lens model at the start, or of a landmark with fewer
  /// than two usable ones.
  std::size_t skipped_observations = 0;
  std::size_t variable_views = 0;  ///< that have an observation
  std::size_t landmarks = 0;       ///< that have observations
  int iterations = 0;              ///< trust region steps tried
  double initial_cost = 0.0;       ///< half the sum above
  double final_cost = 0.0;
  double initial_rmse_px =
      0.0;  ///< root mean square length of the reprojection errors, unweighted, no loss
  double final_rmse_px = 0.0;
};

/// Adjusts the selected part of `scene` in place. `sigmas_px[view][feature]` is the standard
/// deviation of a keypoint (say, in proportion to its scale); no span, or an empty vector for a
/// view, means 1 px.
///
/// Gauge: with no constant view (and variable landmarks) the first variable view that has
/// observations keeps its pose; with fewer than two constant views the translation of the farthest
/// view from it keeps its largest changing coordinate, which holds the scale. Constant views, fixed
/// intrinsics and unselected landmarks keep their bits.
///
/// An observation that cannot be projected at the start is left out. One that loses its projection
/// during the solution (the point moves behind the camera) weighs like an error of 1000 px that no
/// small step changes.
///
/// Deterministic: the same bits for every executor. Precondition: `options.validate()`, indices in
/// range, scene sides consistent.
[[nodiscard]] BundleReport adjust_bundle(Scene& scene,
                                         const BundleSelection& selection,
                                         const BundleOptions& options,
                                         std::span<const std::vector<float>> sigmas_px,
                                         Executor& executor);

/// The same in the calling thread alone.
[[nodiscard]] BundleReport adjust_bundle(Scene& scene,
                                         const BundleSelection& selection,
                                         const BundleOptions& options,
                                         std::span<const std::vector<float>> sigmas_px = {});

}  // namespace trigmesh
