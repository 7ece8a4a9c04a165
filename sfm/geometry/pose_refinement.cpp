// With p = R x + t and the update R <- exp(w) R, t <- exp(w) t + v, f <- f exp(s):
//
//   d p / d (w, v) = [ -[p]x | I ],   d pixel = (d pixel / d p)(d p) + (fx d pixel / d fx + fy d
//   pixel / d fy) s
//
// (R. Hartley, A. Zisserman, "Multiple View Geometry", 2nd edition 2003, section A6.) The Cauchy
// loss c^2 log(1 + r^2 / c^2) enters as the weight 1 / (1 + r^2 / c^2) (B. Triggs et al., "Bundle
// Adjustment - A Modern Synthesis", 2000, section 4.3, without the second-order term).
#include "sfm/geometry/pose_refinement.hpp"

#include <cmath>
#include <optional>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "sfm/geometry/levenberg_marquardt.hpp"

namespace trigmesh {

namespace {

constexpr int kPoseDof = 6;
constexpr int kPoseAndFocalDof = 7;

template <int kDof>
PosedCamera moved(const PosedCamera& at, const Eigen::Matrix<double, kDof, 1>& delta) {
  PosedCamera out = at;
  const Eigen::Vector3d turn = delta.template head<3>();
  const double angle = turn.norm();
  const Eigen::Quaterniond rotation =
      angle > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle))
                  : Eigen::Quaterniond::Identity();
  out.cam_from_world.rotation = (rotation * at.cam_from_world.rotation).normalized();
  out.cam_from_world.translation =
      rotation * at.cam_from_world.translation + delta.template segment<3>(3);
  if constexpr (kDof == kPoseAndFocalDof) {
    const double factor = std::exp(delta[6]);
    out.camera.fx_px *= factor;
    out.camera.fy_px *= factor;
  }
  return out;
}

template <int kDof>
Eigen::Matrix<double, 2, kDof> jacobian_of(const Camera& camera,
                                           const ProjectionDerivatives& projection,
                                           const Eigen::Vector3d& p) {
  Eigen::Matrix<double, 2, kDof> jacobian;
  for (Eigen::Index row = 0; row < 2; ++row) {
    const Eigen::Vector3d d = projection.d_point.row(row);
    jacobian.row(row).template head<3>() = p.cross(d);
    jacobian.row(row).template segment<3>(3) = d;
  }
  if constexpr (kDof == kPoseAndFocalDof) {
    jacobian.col(6) = camera.fx_px * projection.d_intrinsics.col(0) +
                      camera.fy_px * projection.d_intrinsics.col(1);
  }
  return jacobian;
}

template <int kDof>
PoseRefinement refine(const PosedCamera& start,
                      std::span<const Eigen::Vector2d> pixels,
                      std::span<const Eigen::Vector3d> points_in_world,
                      std::span<const std::uint8_t> mask,
                      double loss_scale_px,
                      int max_iterations) {
  const double scale2 = loss_scale_px * loss_scale_px;
  const auto linearize = [&](const PosedCamera& at) -> std::optional<NormalEquations<kDof>> {
    NormalEquations<kDof> equations;
    const Eigen::Matrix3d rotation = at.cam_from_world.rotation.toRotationMatrix();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (mask[i] == 0) {
        continue;
      }
      const Eigen::Vector3d p = rotation * points_in_world[i] + at.cam_from_world.translation;
      const auto projection = project_with_derivatives(at.camera, p);
      if (!projection) {
        return std::nullopt;
      }
      const Eigen::Vector2d residual = projection->pixel - pixels[i];
      const double ratio = residual.squaredNorm() / scale2;
      equations.add(jacobian_of<kDof>(at.camera, *projection, p), residual, 1.0 / (1.0 + ratio));
      equations.cost += scale2 * std::log1p(ratio);
    }
    return equations;
  };
  const auto minimum =
      levenberg_marquardt<kDof>(start, linearize, moved<kDof>, {.max_iterations = max_iterations});
  PoseRefinement out{.result = minimum.state, .usable = minimum.usable};
  const auto equations = linearize(minimum.state);
  if (!equations) {
    return out;
  }
  // Correlation form, so that the units of rotation and translation do not matter.
  using Matrix = Eigen::Matrix<double, kDof, kDof>;
  Matrix normal = equations->jtj.template selfadjointView<Eigen::Lower>();
  const Eigen::Matrix<double, kDof, 1> inverse_scale =
      normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  normal = inverse_scale.asDiagonal() * normal * inverse_scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(normal);
  constexpr double kUndetermined = 1e-10;
  out.determined = solver.eigenvalues()[0] > kUndetermined;
  if constexpr (kDof == kPoseAndFocalDof) {
    const auto last = solver.eigenvectors().row(6).array();
    const double variance =
        (last.square() / solver.eigenvalues().array().transpose().max(1e-30)).sum();
    out.focal_sigma_per_px = std::sqrt(variance) * inverse_scale[6];
  }
  return out;
}

}  // namespace

PoseRefinement refine_pose(const PosedCamera& start,
                           std::span<const Eigen::Vector2d> pixels,
                           std::span<const Eigen::Vector3d> points_in_world,
                           std::span<const std::uint8_t> mask,
                           double loss_scale_px,
                           PoseUnknowns unknowns,
                           int max_iterations) {
  return unknowns == PoseUnknowns::kPose
             ? refine<kPoseDof>(start, pixels, points_in_world, mask, loss_scale_px, max_iterations)
             : refine<kPoseAndFocalDof>(
                   start, pixels, points_in_world, mask, loss_scale_px, max_iterations);
}

}  // namespace trigmesh
