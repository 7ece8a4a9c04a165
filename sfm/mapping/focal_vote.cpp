#include "sfm/mapping/focal_vote.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

namespace trigmesh {

namespace {

constexpr double kSmallestRatio = 0.4;
constexpr double kLargestRatio = 4.0;
constexpr int kGridSteps = 120;
constexpr double kRatioWithoutEvidence = 1.2;
// Above this, a pair says nothing about the focal length: wrong geometry or a degenerate motion.
constexpr double kTruncation = 0.15;
constexpr int kMaxSweeps = 4;

double longer_side(const Camera& camera) {
  return std::max(camera.width_px, camera.height_px);
}

Eigen::Matrix3d calibration(const Camera& camera, double focal_px) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = k(1, 1) = focal_px;
  k(0, 2) = camera.cx_px;
  k(1, 2) = camera.cy_px;
  return k;
}

/// (s1 - s2) / (s1 + s2) of the two large singular values.
double singular_value_gap(const Eigen::Matrix3d& essential) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(essential.transpose() * essential, Eigen::EigenvaluesOnly);
  const double large = std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
  const double middle = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
  return large > 0.0 ? (large - middle) / (large + middle) : 1.0;
}

/// Which pairs vote for a group.
enum class Voters {
  kOwnPairs,  ///< both images of the group: the other groups do not matter
  kAllPairs,
};

class Election {
 public:
  Election(std::span<const Camera> cameras,
           std::span<const FocalEvidence> evidence,
           std::vector<double> focal_px)
      : cameras_(cameras), evidence_(evidence), focal_px_(std::move(focal_px)) {}

  [[nodiscard]] bool has_evidence(CameraId camera, Voters voters) const {
    return std::any_of(evidence_.begin(), evidence_.end(), [&](const FocalEvidence& e) {
      return votes(e, camera, voters);
    });
  }

  /// Best focal length of one group with the others as they are.
  [[nodiscard]] double best(CameraId camera, Voters voters) const {
    const double side = longer_side(cameras_[index(camera)]);
    const double step = std::log(kLargestRatio / kSmallestRatio) / (kGridSteps - 1);
    std::vector<double> costs(kGridSteps);
    for (int i = 0; i < kGridSteps; ++i) {
      costs[static_cast<std::size_t>(i)] =
          cost(camera, voters, side * kSmallestRatio * std::exp(step * i));
    }
    const auto lowest =
        static_cast<int>(std::min_element(costs.begin(), costs.end()) - costs.begin());
    return side * kSmallestRatio * std::exp(step * (lowest + parabola_offset(costs, lowest)));
  }

  [[nodiscard]] double focal_px(CameraId camera) const { return focal_px_[index(camera)]; }

  void elect(CameraId camera, double focal_px) { focal_px_[index(camera)] = focal_px; }

  [[nodiscard]] std::vector<double> result() const { return focal_px_; }

 private:
  static bool votes(const FocalEvidence& e, CameraId camera, Voters voters) {
    return voters == Voters::kOwnPairs ? e.first == camera && e.second == camera
                                       : e.first == camera || e.second == camera;
  }

  [[nodiscard]] double cost(CameraId camera, Voters voters, double focal_px) const {
    double sum = 0.0;
    for (const FocalEvidence& e : evidence_) {
      if (!votes(e, camera, voters)) {
        continue;
      }
      const double first = e.first == camera ? focal_px : focal_px_[index(e.first)];
      const double second = e.second == camera ? focal_px : focal_px_[index(e.second)];
      const Eigen::Matrix3d essential = calibration(cameras_[index(e.second)], second).transpose() *
                                        e.fundamental *
                                        calibration(cameras_[index(e.first)], first);
      sum += e.weight * std::min(singular_value_gap(essential), kTruncation);
    }
    return sum;
  }

  static double parabola_offset(const std::vector<double>& costs, int lowest) {
    if (lowest == 0 || lowest + 1 == kGridSteps) {
      return 0.0;
    }
    const auto at = static_cast<std::size_t>(lowest);
    const double curvature = costs[at - 1] - 2.0 * costs[at] + costs[at + 1];
    return curvature > 0.0
               ? std::clamp(0.5 * (costs[at - 1] - costs[at + 1]) / curvature, -0.5, 0.5)
               : 0.0;
  }

  std::span<const Camera> cameras_;
  std::span<const FocalEvidence> evidence_;
  std::vector<double> focal_px_;
};

}  // namespace

std::vector<double> vote_focal_lengths(std::span<const Camera> cameras,
                                       const std::vector<bool>& unknown,
                                       std::span<const FocalEvidence> evidence) {
  std::vector<double> start(cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    start[i] = unknown[i] ? kRatioWithoutEvidence * longer_side(cameras[i]) : cameras[i].fx_px;
  }
  Election election(cameras, evidence, start);
  // One group after the other ends in a kink of the cost when all begin far off: pairs between two
  // groups fix their product, so neither can leave alone. Pairs within a group have no such kink.
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const auto camera = id_of<CameraId>(i);
    if (unknown[i] && election.has_evidence(camera, Voters::kOwnPairs)) {
      election.elect(camera, election.best(camera, Voters::kOwnPairs));
    }
  }
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    bool changed = false;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const auto camera = id_of<CameraId>(i);
      if (!unknown[i] || !election.has_evidence(camera, Voters::kAllPairs)) {
        continue;
      }
      const double better = election.best(camera, Voters::kAllPairs);
      changed = changed || std::abs(better / election.focal_px(camera) - 1.0) > 1e-6;
      election.elect(camera, better);
    }
    if (!changed) {
      break;
    }
  }
  return election.result();
}

}  // namespace trigmesh
