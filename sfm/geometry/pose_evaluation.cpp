#include "sfm/geometry/pose_evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/geometry/similarity.hpp"

namespace trigmesh {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

using PosesByKey = std::map<std::string, Rigid3>;

enum class Naming { kStem, kFull };

std::string key_of(const NamedPose& pose, Naming naming) {
  return naming == Naming::kFull ? pose.name : std::filesystem::path(pose.name).stem().string();
}

bool are_distinct(std::span<const NamedPose> poses, Naming naming) {
  std::set<std::string> keys;
  return std::ranges::all_of(
      poses, [&](const NamedPose& pose) { return keys.insert(key_of(pose, naming)).second; });
}

PosesByKey index_by_key(std::span<const NamedPose> poses, Naming naming) {
  PosesByKey by_key;
  for (const NamedPose& pose : poses) {
    by_key.emplace(key_of(pose, naming), pose.cam_from_world);
  }
  return by_key;
}

/// Two poses of the same image.
struct PosePair {
  Rigid3 truth;
  Rigid3 estimate;
};

double median_of_sorted(const std::vector<double>& sorted) {
  const std::size_t middle = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[middle] : 0.5 * (sorted[middle - 1] + sorted[middle]);
}

double angle_between_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  constexpr double kNoDirection = 1e-12;
  if (a.norm() * b.norm() < kNoDirection) {
    return 90.0;  // one has no direction: neither right nor opposite
  }
  return std::atan2(a.cross(b).norm(), a.dot(b)) * kDegPerRad;
}

/// The larger of the rotation angle and the angle between the directions of translation.
double relative_pose_error_deg(const PosePair& first, const PosePair& second) {
  const Rigid3 truth = second.truth * first.truth.inverse();
  const Rigid3 estimate = second.estimate * first.estimate.inverse();
  const double rotation_deg =
      rotation_angle(estimate.rotation * truth.rotation.conjugate()) * kDegPerRad;
  return std::max(rotation_deg, angle_between_deg(truth.translation, estimate.translation));
}

void score_pairs(const std::vector<PosePair>& pairs, PoseEvaluation& evaluation) {
  const std::size_t n = evaluation.truth_count;
  std::vector<double> errors_deg(n * (n - 1) / 2, std::numeric_limits<double>::infinity());
  auto next = errors_deg.begin();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t j = i + 1; j < pairs.size(); ++j) {
      *next++ = relative_pose_error_deg(pairs[i], pairs[j]);
    }
  }
  evaluation.auc_1_deg = recall_area(errors_deg, 1.0);
  evaluation.auc_3_deg = recall_area(errors_deg, 3.0);
  evaluation.auc_5_deg = recall_area(std::move(errors_deg), 5.0);
}

Result<> score_aligned(const std::vector<PosePair>& pairs,
                       ScaleAlignment scale,
                       PoseEvaluation& evaluation) {
  std::vector<Eigen::Vector3d> true_centers;
  std::vector<Eigen::Vector3d> estimated_centers;
  for (const PosePair& pair : pairs) {
    true_centers.push_back(camera_center(pair.truth));
    estimated_centers.push_back(camera_center(pair.estimate));
  }
  const Alignment alignment = align_points(
      estimated_centers,
      true_centers,
      scale == ScaleAlignment::kFitted ? ScaleMode::kEstimated : ScaleMode::kFixedToOne);
  if (alignment.outcome != AlignmentOutcome::kOk) {
    return fail(ErrorCode::kInsufficientData,
                "the positions of the {} images in both models lie on one line or coincide, which "
                "leaves the alignment open",
                pairs.size());
  }
  const Sim3& truth_from_estimate = alignment.b_from_a;
  std::vector<double> errors;
  std::vector<double> rotations_deg;
  double sum_of_squares = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    errors.push_back((truth_from_estimate * estimated_centers[i] - true_centers[i]).norm());
    sum_of_squares += errors.back() * errors.back();
    const Eigen::Quaterniond difference = pairs[i].estimate.rotation *
                                          truth_from_estimate.rotation.conjugate() *
                                          pairs[i].truth.rotation.conjugate();
    rotations_deg.push_back(rotation_angle(difference) * kDegPerRad);
  }
  std::ranges::sort(errors);
  std::ranges::sort(rotations_deg);
  evaluation.position_rmse = std::sqrt(sum_of_squares / static_cast<double>(pairs.size()));
  evaluation.position_median = median_of_sorted(errors);
  evaluation.position_max = errors.back();
  evaluation.rotation_median_deg = median_of_sorted(rotations_deg);
  return {};
}

}  // namespace

Result<PoseEvaluation> evaluate_poses(std::span<const NamedPose> truth,
                                      std::span<const NamedPose> estimate,
                                      ScaleAlignment scale) {
  const Naming naming = are_distinct(truth, Naming::kStem) && are_distinct(estimate, Naming::kStem)
                            ? Naming::kStem
                            : Naming::kFull;
  if (!are_distinct(truth, naming) || !are_distinct(estimate, naming)) {
    return fail(ErrorCode::kInvalidArgument, "an image has two poses in the same model");
  }
  const PosesByKey estimate_by_key = index_by_key(estimate, naming);
  std::vector<PosePair> pairs;
  for (const auto& [key, pose] : index_by_key(truth, naming)) {
    if (const auto found = estimate_by_key.find(key); found != estimate_by_key.end()) {
      pairs.push_back({pose, found->second});
    }
  }
  PoseEvaluation evaluation;
  evaluation.truth_count = truth.size();
  evaluation.registered = pairs.size();
  if (pairs.size() < 3) {
    return fail(ErrorCode::kInsufficientData,
                "only {} of the {} images with a true pose are in the model, at least 3 are needed",
                pairs.size(),
                truth.size());
  }
  TM_RETURN_IF_ERROR(score_aligned(pairs, scale, evaluation));
  score_pairs(pairs, evaluation);
  return evaluation;
}

double recall_area(std::vector<double> errors, double limit) {
  std::ranges::sort(errors);
  const double n = static_cast<double>(errors.size());
  double area = 0.0;
  double last_error = 0.0;
  double last_recall = 0.0;
  for (std::size_t i = 0; i < errors.size() && errors[i] < limit; ++i) {
    const double recall = static_cast<double>(i + 1) / n;
    area += 0.5 * (last_recall + recall) * (errors[i] - last_error);
    last_error = errors[i];
    last_recall = recall;
  }
  return (area + last_recall * (limit - last_error)) / limit;
}

}  // namespace trigmesh
