#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "sfm/mapping/bundle_problem.hpp"

// The normal equations of a bundle problem with the points eliminated.
//
// With J the Jacobian of the weighted residuals, split in cameras (poses and intrinsics) and
// points, and D = diag(J^T J):
//
//   [U + l Du   W       ] [dc]     [gc]       one step of Levenberg-Marquardt, damping l
//   [W^T        V + l Dv] [dp] = - [gp]
//
// V is block diagonal, V_j + l Dv_j = L_j L_j^T. With Z_ij = W_ij L_j^-T:
//
//   S = U + l Du - sum_j Z_j Z_j^T,   S dc = -(gc - sum_j Z_j L_j^-1 gp_j),   dp_j = -L_j^-T
//   (L_j^-1 gp_j + Z_j^T dc)
//
// (B. Triggs et al., "Bundle Adjustment - A Modern Synthesis", 1999, section 6.1.) Every block of S
// is 6 x 6: intrinsics take one or two blocks of six, padded with unknowns that nothing depends on.
// One point after another is linearised and eliminated while its numbers are in the cache; of the
// Jacobian only Z is kept.

namespace trigmesh {

/// Which unknowns stand where. Made once for a problem.
class SchurLayout {
 public:
  static constexpr std::size_t kBlock = 6;
  static constexpr std::uint32_t kHeld = 0xffffffffU;

  explicit SchurLayout(const BundleProblem& problem);

  [[nodiscard]] std::size_t block_count() const { return block_count_; }

  [[nodiscard]] std::size_t unknown_count() const { return block_count_ * kBlock; }

  /// By pose: its block, or kHeld.
  [[nodiscard]] std::uint32_t pose_block(std::size_t pose) const { return pose_block_[pose]; }

  /// By camera: its first block, or kHeld; all after those of the poses.
  [[nodiscard]] std::uint32_t camera_block(std::size_t camera) const {
    return camera_block_[camera];
  }

  [[nodiscard]] std::size_t camera_block_count(std::size_t camera) const {
    return camera_block_count_[camera];
  }

  /// Observations of point j: [first_observation(j), first_observation(j + 1)).
  [[nodiscard]] std::size_t first_observation(std::size_t point) const {
    return first_observation_[point];
  }

  /// Entries Z of point j: [first_entry(j), first_entry(j + 1)), blocks ascending.
  [[nodiscard]] std::size_t first_entry(std::size_t point) const { return first_entry_[point]; }

  [[nodiscard]] std::size_t entry_count() const { return entry_block_.size(); }

  [[nodiscard]] std::uint32_t entry_block(std::size_t entry) const { return entry_block_[entry]; }

  /// Of the first entry of the observation's camera, counted from the first entry of its point.
  /// Only if not held.
  [[nodiscard]] std::size_t camera_entry(std::size_t observation) const {
    return camera_entry_[observation];
  }

 private:
  void number_blocks(const BundleProblem& problem);
  void add_camera_entries(const BundleProblem& problem, std::size_t point);

  std::size_t block_count_ = 0;
  std::vector<std::uint32_t> pose_block_;
  std::vector<std::uint32_t> camera_block_;
  std::vector<std::size_t> camera_block_count_;
  std::vector<std::size_t> first_observation_;
  std::vector<std::size_t> first_entry_;
  std::vector<std::uint32_t> entry_block_;
  std::vector<std::uint32_t> camera_entry_;
};

/// What is summed over points: lower triangle of S in 6 x 6 blocks, and the right side.
struct SchurSums {
  std::vector<double> blocks;     ///< block (r, c), c <= r, row-major, at 36 (r (r + 1) / 2 + c)
  std::vector<double> gradient;   ///< gc
  std::vector<double> reduction;  ///< sum_j Z_j L_j^-1 gp_j
  std::vector<double> diagonal;   ///< Du

  void reset(std::size_t block_count);
  void add(const SchurSums& other);
};

/// What is kept of an eliminated point to find its step.
struct EliminatedPoint {
  std::array<double, 6>
      factor{};  ///< L by rows: l00 l10 l11 l20 l21 l22; all zero: the point is held
  Eigen::Vector3d half_step = Eigen::Vector3d::Zero();  ///< L^-1 gp
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();   ///< gp
  Eigen::Vector3d diagonal = Eigen::Vector3d::Zero();   ///< Dv
};

/// Z^T: three rows of six.
using SchurEntry = std::array<double, 18>;

/// Where the results per point and per entry are written; pieces of points may be worked on at the
/// same time.
struct SchurPoints {
  std::vector<EliminatedPoint> points;
  std::vector<SchurEntry> entries;
};

/// rho(s), s the squared length of a residual.
[[nodiscard]] double loss_of(const BundleOptions& options, double s);

/// Its derivative rho'(s).
[[nodiscard]] double loss_weight(const BundleOptions& options, double s);

/// Linearises and eliminates the points [first, last) and adds them to `sums`.
void eliminate_points(const BundleProblem& problem,
                      const BundleOptions& options,
                      const SchurLayout& layout,
                      double damping,
                      std::pair<std::size_t, std::size_t> range,
                      SchurPoints& out,
                      SchurSums& sums);

/// The step of one point, given that of the cameras (`layout.unknown_count()` numbers).
[[nodiscard]] Eigen::Vector3d point_step(const SchurLayout& layout,
                                         const SchurPoints& eliminated,
                                         std::size_t point,
                                         const Eigen::VectorXd& camera_step);

}  // namespace trigmesh
