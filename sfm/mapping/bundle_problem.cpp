#include "sfm/mapping/bundle_problem.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr std::uint32_t kNotSelected = std::numeric_limits<std::uint32_t>::max();

/// Sorted, without repetition.
template <typename Id>
std::vector<Id> as_set(std::vector<Id> ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

void add_poses(const Scene& scene, const BundleSelection& selection, BundleProblem& problem) {
  const std::vector<ViewId> variable = as_set(selection.variable_views);
  const std::vector<ViewId> constant = as_set(selection.constant_views);
  std::merge(variable.begin(),
             variable.end(),
             constant.begin(),
             constant.end(),
             std::back_inserter(problem.pose_views));
  problem.poses.resize(problem.pose_views.size());
  problem.pose_observations.assign(problem.pose_views.size(), 0);
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const ViewId id = problem.pose_views[i];
    TM_CHECK(index(id) < scene.views.size() && scene.views[index(id)].cam_from_world.has_value());
    TM_CHECK(i == 0 || problem.pose_views[i - 1] != id);
    problem.poses[i].base = *scene.views[index(id)].cam_from_world;
    problem.pose_is_variable.push_back(
        std::binary_search(variable.begin(), variable.end(), id) ? 1 : 0);
  }
}

void add_cameras(const Scene& scene, const BundleOptions& options, BundleProblem& problem) {
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const IntrinsicsFreedom freedom =
        i < options.intrinsics.size() ? options.intrinsics[i] : IntrinsicsFreedom{};
    problem.cameras.emplace_back(scene.cameras[i], freedom);
  }
  problem.camera_observations.assign(scene.cameras.size(), 0);
}

/// Collects the observations of one landmark after another.
class ObservationCollector {
 public:
  ObservationCollector(const Scene& scene,
                       std::span<const std::vector<float>> sigmas_px,
                       BundleProblem& problem)
      : scene_(scene),
        sigmas_px_(sigmas_px),
        problem_(problem),
        pose_of_view_(scene.views.size(), kNotSelected) {
    for (std::size_t i = 0; i < problem.pose_views.size(); ++i) {
      pose_of_view_[index(problem.pose_views[i])] = static_cast<std::uint32_t>(i);
    }
  }

  void add(LandmarkId id) {
    TM_CHECK(index(id) < scene_.landmarks.size());
    const Landmark& landmark = scene_.landmarks[index(id)];
    const std::size_t before = problem_.observations.size();
    std::size_t selected = 0;
    for (const Observation& seen : landmark.track) {
      if (pose_of_view_[index(seen.view)] != kNotSelected) {
        ++selected;
        add_if_projectable(seen, landmark.position_in_world);
      }
    }
    const std::size_t needed = problem_.points_are_variable ? 2 : 1;
    if (problem_.observations.size() - before < needed) {
      problem_.observations.resize(before);
    } else {
      problem_.point_landmarks.push_back(id);
      problem_.points.push_back(landmark.position_in_world);
    }
    problem_.skipped_observations += selected - (problem_.observations.size() - before);
  }

 private:
  void add_if_projectable(const Observation& seen, const Eigen::Vector3d& point) {
    const View& view = scene_.views[index(seen.view)];
    const std::uint32_t pose = pose_of_view_[index(seen.view)];
    const PoseState& state = problem_.poses[pose];
    const Eigen::Vector3d point_in_cam = state.rotation * point + state.translation;
    if (!project(scene_.cameras[index(view.camera)], point_in_cam)) {
      return;
    }
    problem_.observations.push_back({.pose = pose,
                                     .camera = static_cast<std::uint32_t>(index(view.camera)),
                                     .point = static_cast<std::uint32_t>(problem_.points.size()),
                                     .inverse_sigma = inverse_sigma(seen),
                                     .pixel = view.keypoints_px[index(seen.feature)]});
  }

  [[nodiscard]] float inverse_sigma(const Observation& seen) const {
    if (index(seen.view) >= sigmas_px_.size() || sigmas_px_[index(seen.view)].empty()) {
      return 1.0F;
    }
    const float sigma = sigmas_px_[index(seen.view)][index(seen.feature)];
    TM_CHECK(sigma > 0.0F);
    return 1.0F / sigma;
  }

  const Scene& scene_;
  std::span<const std::vector<float>> sigmas_px_;
  BundleProblem& problem_;
  std::vector<std::uint32_t> pose_of_view_;
};

void count_observations(BundleProblem& problem) {
  for (const BundleObservation& observation : problem.observations) {
    ++problem.pose_observations[observation.pose];
    ++problem.camera_observations[observation.camera];
  }
}

/// Holds the seven freedoms that no observation sees: see `adjust_bundle`.
void fix_gauge(BundleProblem& problem) {
  const std::size_t count = problem.poses.size();
  std::vector<std::size_t> held;
  std::size_t first_variable = count;
  for (std::size_t i = 0; i < count; ++i) {
    if (problem.pose_observations[i] == 0) {
      continue;
    }
    if (problem.pose_is_variable[i] == 0) {
      held.push_back(i);
    } else if (first_variable == count) {
      first_variable = i;
    }
  }
  if (!problem.points_are_variable || held.size() >= 2 || first_variable == count) {
    return;
  }
  if (held.empty()) {
    problem.pose_is_variable[first_variable] = 0;
    held.push_back(first_variable);
  }
  const Eigen::Vector3d origin = camera_center(problem.poses[held.front()].base);
  double farthest = 0.0;
  PoseState* scale_holder = nullptr;
  for (std::size_t i = 0; i < count; ++i) {
    const double distance = (camera_center(problem.poses[i].base) - origin).norm();
    if (problem.pose_is_variable[i] != 0 && problem.pose_observations[i] > 0 &&
        distance > farthest) {
      farthest = distance;
      scale_holder = &problem.poses[i];
    }
  }
  if (scale_holder != nullptr) {
    const Eigen::Vector3d change =
        scale_holder->base.rotation * (camera_center(scale_holder->base) - origin);
    change.cwiseAbs().maxCoeff(&scale_holder->frozen_translation);
  }
}

}  // namespace

std::size_t BundleProblem::variable_pose_count() const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    count += pose_is_variable[i] != 0 && pose_observations[i] > 0 ? 1U : 0U;
  }
  return count;
}

bool BundleProblem::has_free_intrinsics() const {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].free_count > 0 && camera_observations[i] > 0) {
      return true;
    }
  }
  return false;
}

void BundleProblem::update() {
  for (PoseState& pose : poses) {
    pose.update();
  }
  for (IntrinsicsState& camera : cameras) {
    camera.update();
  }
}

double BundleProblem::rmse_px() const {
  double sum = 0.0;
  for (BundleObservation observation : observations) {
    observation.inverse_sigma = 1.0F;
    sum += evaluate_reprojection(poses[observation.pose],
                                 cameras[observation.camera],
                                 points[observation.point],
                                 observation,
                                 {})
               .squaredNorm();
  }
  return observations.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(observations.size()));
}

IntrinsicsPriorValue prior_of_entry(const IntrinsicsFreedom& freedom, int entry) {
  switch (entry) {
    case 0:
      return {freedom.prior.fx_px, freedom.focal_sigma_ratio * freedom.prior.fx_px};
    case 1:
      return {freedom.prior.cx_px, freedom.principal_point_sigma_px};
    case 2:
      return {freedom.prior.cy_px, freedom.principal_point_sigma_px};
    default:
      return {freedom.prior.distortion[static_cast<std::size_t>(entry - 3)],
              freedom.distortion_sigma};
  }
}

BundleProblem build_bundle_problem(const Scene& scene,
                                   const BundleSelection& selection,
                                   const BundleOptions& options,
                                   std::span<const std::vector<float>> sigmas_px) {
  BundleProblem problem;
  problem.points_are_variable = selection.landmark_mode == LandmarkMode::kVariable;
  add_poses(scene, selection, problem);
  add_cameras(scene, options, problem);
  problem.update();
  ObservationCollector collector(scene, sigmas_px, problem);
  for (const LandmarkId id : as_set(selection.landmarks)) {
    collector.add(id);
  }
  count_observations(problem);
  fix_gauge(problem);
  return problem;
}

bool is_sane(const BundleProblem& problem) {
  const auto pose_is_finite = [](const PoseState& pose) {
    return pose.rotation.allFinite() && pose.translation.allFinite();
  };
  const auto camera_is_valid = [](const IntrinsicsState& state) {
    return state.free_count == 0 || state.camera.validate().has_value();
  };
  return std::all_of(problem.poses.begin(), problem.poses.end(), pose_is_finite) &&
         std::all_of(problem.cameras.begin(), problem.cameras.end(), camera_is_valid) &&
         std::all_of(problem.points.begin(), problem.points.end(), [](const Eigen::Vector3d& p) {
           return p.allFinite();
         });
}

void apply_bundle_problem(const BundleProblem& problem, Scene& scene) {
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    if (problem.pose_is_variable[i] != 0 && problem.pose_observations[i] > 0) {
      scene.views[index(problem.pose_views[i])].cam_from_world = problem.poses[i].cam_from_world();
    }
  }
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    if (problem.cameras[i].free_count > 0 && problem.camera_observations[i] > 0) {
      scene.cameras[i] = problem.cameras[i].camera;
    }
  }
  for (std::size_t i = 0; problem.points_are_variable && i < problem.points.size(); ++i) {
    scene.landmarks[index(problem.point_landmarks[i])].position_in_world = problem.points[i];
  }
}

}  // namespace trigmesh
