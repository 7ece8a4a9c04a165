#include "sfm/dense/map_agreement.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/LU>

#include "firmware/base/check.hpp"

namespace trigmesh {

Result<> AgreementOptions::validate() const {
  if (!(max_round_trip_px > 0.0F && max_round_trip_px <= 10.0F)) {
    return fail(
        ErrorCode::kInvalidArgument, "max_round_trip_px is {}, not in (0, 10]", max_round_trip_px);
  }
  if (!(max_depth_ratio > 0.0F && max_depth_ratio <= 0.5F)) {
    return fail(
        ErrorCode::kInvalidArgument, "max_depth_ratio is {}, not in (0, 0.5]", max_depth_ratio);
  }
  if (!(max_normal_deg > 0.0F && max_normal_deg <= 180.0F)) {
    return fail(
        ErrorCode::kInvalidArgument, "max_normal_deg is {}, not in (0, 180]", max_normal_deg);
  }
  return {};
}

MapComparison::MapComparison(const PosedDepthMap& reference,
                             const PosedDepthMap& other,
                             const AgreementOptions& options)
    : reference_(reference.map),
      other_(other.map),
      options_(options),
      min_normal_cosine_(std::cos(options.max_normal_deg * std::numbers::pi_v<float> / 180.0F)) {
  TM_CHECK(reference_.depth.type() == CV_32FC1 && other_.depth.type() == CV_32FC1);
  const Rigid3 motion = other.cam_from_world * reference.cam_from_world.inverse();
  const Eigen::Matrix3d rotation = motion.rotation.toRotationMatrix();
  const Eigen::Matrix3d k_reference = reference_.camera.calibration_matrix();
  const Eigen::Matrix3d k_other = other_.camera.calibration_matrix();
  rotation_ = (k_other * rotation * k_reference.inverse()).cast<float>();
  epipole_ = (k_other * motion.translation).cast<float>();
  back_rotation_ = (k_reference * rotation.transpose() * k_other.inverse()).cast<float>();
  back_epipole_ = (k_reference * motion.inverse().translation).cast<float>();
  other_from_reference_ = rotation.cast<float>();
}

MapOpinion MapComparison::ask(int x, int y) const {
  MapOpinion opinion;
  const float depth = reference_.depth.at<float>(y, x);
  const Eigen::Vector3f pixel(static_cast<float>(x), static_cast<float>(y), 1.0F);
  const Eigen::Vector3f there = rotation_ * pixel * depth + epipole_;
  if (!(there.z() > 0.0F)) {
    return opinion;
  }
  const float column = std::round(there.x() / there.z());
  const float row = std::round(there.y() / there.z());
  if (!(column >= 0.0F && row >= 0.0F && column < static_cast<float>(other_.depth.cols) &&
        row < static_cast<float>(other_.depth.rows))) {
    return opinion;
  }
  opinion.x = static_cast<int>(column);
  opinion.y = static_cast<int>(row);
  const float other_depth = other_.depth.at<float>(opinion.y, opinion.x);
  if (!(other_depth > 0.0F)) {
    return opinion;
  }
  // The surface of the other view, continued from its pixel's centre to where the point lands.
  const auto& n = other_.normal.at<cv::Vec3f>(opinion.y, opinion.x);
  const Eigen::Vector3f normal(n[0], n[1], n[2]);
  const auto ray = [&](float u, float v) {
    return Eigen::Vector3f(
        (u - static_cast<float>(other_.camera.cx_px)) / static_cast<float>(other_.camera.fx_px),
        (v - static_cast<float>(other_.camera.cy_px)) / static_cast<float>(other_.camera.fy_px),
        1.0F);
  };
  const float u = there.x() / there.z();
  const float v = there.y() / there.z();
  const float along = normal.dot(ray(u, v));
  constexpr float kGrazing = -0.05F;
  const float surface_depth =
      along < kGrazing ? other_depth * normal.dot(ray(column, row)) / along : other_depth;
  const float difference = (surface_depth - there.z()) / there.z();
  constexpr float kClearlyBehind = 3.0F;  // tolerances; nearer differences are noise
  if (difference > kClearlyBehind * options_.max_depth_ratio) {
    opinion.verdict = MapVerdict::kConflicts;
    return opinion;
  }
  const Eigen::Vector3f back =
      back_rotation_ * Eigen::Vector3f(u, v, 1.0F) * surface_depth + back_epipole_;
  if (!(std::abs(difference) <= options_.max_depth_ratio && back.z() > 0.0F)) {
    return opinion;
  }
  const float error = std::hypot(back.x() / back.z() - pixel.x(), back.y() / back.z() - pixel.y());
  const auto& m = reference_.normal.at<cv::Vec3f>(y, x);
  const float cosine = (other_from_reference_ * Eigen::Vector3f(m[0], m[1], m[2])).dot(normal);
  if (error <= options_.max_round_trip_px && cosine >= min_normal_cosine_) {
    opinion.verdict = MapVerdict::kAgrees;
    opinion.depth_in_reference = back.z();
  }
  return opinion;
}

}  // namespace trigmesh
