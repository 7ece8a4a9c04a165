#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "sfm/mapping/bundle_adjustment.hpp"
#include "sfm/mapping/reprojection_cost.hpp"

// The selected part of a scene as dense arrays, ready for a solver, and the way back.

namespace trigmesh {

/// Poses, cameras and points under adjustment and the observations that tie them. Plain data.
struct BundleProblem {
  std::vector<ViewId> pose_views;  ///< ascending; by pose
  std::vector<PoseState> poses;
  std::vector<char> pose_is_variable;            ///< by pose; after the gauge was fixed
  std::vector<std::size_t> pose_observations;    ///< by pose: how many
  std::vector<IntrinsicsState> cameras;          ///< by CameraId
  std::vector<std::size_t> camera_observations;  ///< by CameraId: how many
  std::vector<LandmarkId> point_landmarks;       ///< ascending; by point
  std::vector<Eigen::Vector3d> points;           ///< in world
  bool points_are_variable = true;
  std::vector<BundleObservation> observations;  ///< by point, then by view
  std::size_t skipped_observations = 0;

  [[nodiscard]] std::size_t variable_pose_count() const;
  [[nodiscard]] bool has_free_intrinsics() const;
  /// Brings poses and cameras to their parameters.
  void update();
  /// Root mean square length of the reprojection errors at the present state, unweighted.
  [[nodiscard]] double rmse_px() const;
};

/// A Gaussian prior on one entry of IntrinsicsState; sigma 0: none.
struct IntrinsicsPriorValue {
  double mean = 0.0;
  double sigma = 0.0;
};

[[nodiscard]] IntrinsicsPriorValue prior_of_entry(const IntrinsicsFreedom& freedom, int entry);

/// Gathers the selection, leaves out what cannot be projected and fixes the gauge, as
/// `adjust_bundle` documents.
[[nodiscard]] BundleProblem build_bundle_problem(const Scene& scene,
                                                 const BundleSelection& selection,
                                                 const BundleOptions& options,
                                                 std::span<const std::vector<float>> sigmas_px);

/// Whether everything variable is finite and every focal length positive.
[[nodiscard]] bool is_sane(const BundleProblem& problem);

/// Writes what is variable back into the scene.
void apply_bundle_problem(const BundleProblem& problem, Scene& scene);

}  // namespace trigmesh
