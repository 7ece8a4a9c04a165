#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace trigmesh {

/// How far a camera turned and moved between two views of the same corners.
struct ViewChange {
  double motion_deg = 0.0;    ///< median angle between the rays to a corner in both views
  double parallax_deg = 0.0;  ///< the same after the best rotation: a lower bound of the parallax
};

/// Measures it from the rays to each corner in both views. The rotation minimises the sum of the
/// angles (reweighted least squares of Kabsch's solution, Acta Cryst. A32, 1976), so that a near
/// thing does not spoil it. Its memory is used again. Thread-compatible.
class ViewChangeMeter {
 public:
  /// Forgets the rays of the views before.
  void begin();

  /// Unit vectors in the frames of the two cameras, to the same corner.
  void add(const Eigen::Vector3d& first, const Eigen::Vector3d& second);

  [[nodiscard]] std::size_t ray_count() const { return rays_.size(); }

  /// Zero with fewer than 3 rays.
  [[nodiscard]] ViewChange measure();

 private:
  struct RayPair {
    Eigen::Vector3d first;
    Eigen::Vector3d second;
    double angle = 0.0;  ///< after the rotation found last, radians
  };

  void rotate(const Eigen::Matrix3d& rotation);
  [[nodiscard]] Eigen::Matrix3d weighted_rotation() const;
  [[nodiscard]] double median_angle_deg();

  std::vector<RayPair> rays_;
  std::vector<double> angles_;  ///< to take a median of
};

}  // namespace trigmesh
