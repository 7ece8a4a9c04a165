// Levenberg-Marquardt with the damping l = 1 / radius on the diagonal of J^T J, and the radius
// after H. B. Nielsen, "Damping Parameter in Marquardt's Method", IMM-REP-1999-05: with the gain
// ratio q = actual / predicted decrease,
//
//   q > 0:  radius /= max(1/3, 1 - (2 q - 1)^3), nu = 2;    else:  radius /= nu, nu *= 2
//
// and the decrease that the linear model predicts for a step d: (l d^T D d - d^T g) / 2. Robust
// losses enter as weights rho' of the squared residuals (iteratively reweighted least squares).
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "sfm/mapping/bundle_solvers.hpp"
#include "sfm/mapping/schur_system.hpp"

namespace trigmesh {
namespace {

constexpr double kFirstRadius = 1e4;
constexpr double kMinRadius = 1e-32;
constexpr double kMaxRadius = 1e16;
constexpr double kMinGain = 1e-3;  // of a step that is taken
constexpr std::size_t kBlock = SchurLayout::kBlock;

/// What a step changes.
struct Unknowns {
  std::vector<std::array<double, PoseState::kSize>> poses;
  std::vector<std::array<double, IntrinsicsState::kFullSize>> cameras;
  std::vector<Eigen::Vector3d> points;
};

/// What is asked of a step before it is tried.
struct StepModel {
  double predicted_decrease = 0.0;
  double squared_length = 0.0;
};

/// A Gaussian prior on one unknown.
struct PriorTerm {
  std::size_t camera = 0;
  std::size_t parameter = 0;  ///< position in IntrinsicsState::parameters
  IntrinsicsPriorValue prior;
};

class SchurSolver {
 public:
  SchurSolver(BundleProblem& problem, const BundleOptions& options, Executor& executor)
      : problem_(problem), options_(options), executor_(executor), layout_(problem) {
    eliminated_.points.resize(problem.points_are_variable ? problem.points.size() : 0);
    eliminated_.entries.resize(layout_.entry_count());
    split_points();
    sums_.resize(ranges_.size());
    collect_priors();
  }

  SolverSummary solve() {
    SolverSummary summary;
    double cost = evaluate();
    summary.initial_cost = cost;
    summary.outcome = BundleOutcome::kMaxIterations;
    while (summary.iterations < options_.max_iterations) {
      ++summary.iterations;
      linearize();
      const Step step = try_step(cost);
      if (step.accepted) {
        const double decrease = cost - step.cost;
        cost = step.cost;
        if (step.is_short || decrease <= options_.function_tolerance * cost) {
          summary.outcome = BundleOutcome::kConverged;
          break;
        }
      } else if (step.is_short || radius_ < kMinRadius) {
        summary.outcome = BundleOutcome::kConverged;
        break;
      }
    }
    summary.final_cost = cost;
    if (!std::isfinite(cost)) {
      summary.outcome = BundleOutcome::kFailed;
    }
    return summary;
  }

 private:
  struct Step {
    bool accepted = false;
    bool is_short = false;  ///< below the tolerance of the parameters
    double cost = 0.0;
  };

  /// Pieces of points with about equally many observations; their number depends on nothing but the
  /// problem, so that sums are formed in the same order whatever executes them.
  void split_points() {
    constexpr std::size_t kObservationsPerPiece = 2048;
    constexpr std::size_t kMaxPieces = 4;
    const std::size_t all = problem_.observations.size();
    const std::size_t pieces = std::clamp<std::size_t>(all / kObservationsPerPiece, 1, kMaxPieces);
    std::size_t first = 0;
    for (std::size_t i = 1; i <= pieces; ++i) {
      std::size_t last = i == pieces ? problem_.points.size() : first;
      while (last < problem_.points.size() && layout_.first_observation(last) < all * i / pieces) {
        ++last;
      }
      ranges_.emplace_back(first, last);
      first = last;
    }
  }

  void collect_priors() {
    for (std::size_t i = 0; i < problem_.cameras.size(); ++i) {
      const IntrinsicsState& camera = problem_.cameras[i];
      if (layout_.camera_block(i) == SchurLayout::kHeld) {
        continue;
      }
      for (std::size_t p = 0; p < static_cast<std::size_t>(camera.free_count); ++p) {
        const auto prior = prior_of_entry(options_.intrinsics[i], camera.free[p]);
        if (prior.sigma > 0.0) {
          priors_.push_back({i, p, prior});
        }
      }
    }
  }

  void linearize() {
    executor_.for_each_index(ranges_.size(), [this](std::size_t piece) {
      sums_[piece].reset(layout_.block_count());
      eliminate_points(
          problem_, options_, layout_, 1.0 / radius_, ranges_[piece], eliminated_, sums_[piece]);
    });
    for (std::size_t piece = 1; piece < sums_.size(); ++piece) {
      sums_[0].add(sums_[piece]);
    }
    add_priors(sums_[0]);
  }

  void add_priors(SchurSums& sums) const {
    for (const PriorTerm& term : priors_) {
      const std::size_t block = layout_.camera_block(term.camera) + term.parameter / kBlock;
      const std::size_t at = term.parameter % kBlock;
      const double inverse = 1.0 / term.prior.sigma;
      sums.gradient[kBlock * block + at] += prior_residual(term) * inverse;
      sums.diagonal[kBlock * block + at] += inverse * inverse;
      sums.blocks[36 * (block * (block + 1) / 2 + block) + (kBlock + 1) * at] += inverse * inverse;
    }
  }

  [[nodiscard]] double prior_residual(const PriorTerm& term) const {
    return (problem_.cameras[term.camera].parameters[term.parameter] - term.prior.mean) /
           term.prior.sigma;
  }

  /// Diagonal of the damping; unknowns that nothing depends on get 1, so that they stay.
  [[nodiscard]] double camera_damping(std::size_t unknown) const {
    const double d = sums_[0].diagonal[unknown];
    return d > 0.0 ? d / radius_ : 1.0;
  }

  /// Solves the reduced system; false when it is not positive definite.
  bool solve_cameras() {
    const auto size = static_cast<Eigen::Index>(layout_.unknown_count());
    const SchurSums& sums = sums_[0];
    reduced_.resize(size, size);
    camera_step_.resize(size);
    for (std::size_t r = 0; r < layout_.block_count(); ++r) {
      for (std::size_t c = 0; c <= r; ++c) {
        using Block = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
        reduced_.block<6, 6>(static_cast<Eigen::Index>(kBlock * r),
                             static_cast<Eigen::Index>(kBlock * c)) =
            Eigen::Map<const Block>(sums.blocks.data() + 36 * (r * (r + 1) / 2 + c));
      }
    }
    for (std::size_t i = 0; i < layout_.unknown_count(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      reduced_(at, at) += camera_damping(i);
      camera_step_[at] = sums.reduction[i] - sums.gradient[i];
    }
    if (size == 0) {
      return true;
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(reduced_);
    if (factor.info() != Eigen::Success) {
      return false;
    }
    factor.solveInPlace(camera_step_);
    return camera_step_.allFinite();
  }

  Step try_step(double cost) {
    Step step;
    if (!solve_cameras()) {
      shrink();
      return step;
    }
    save();
    const StepModel model = move();
    const double tolerance = options_.parameter_tolerance;
    step.is_short = std::sqrt(model.squared_length) <= tolerance * (parameter_norm() + tolerance);
    step.cost = evaluate();
    const double gain = (cost - step.cost) / model.predicted_decrease;
    step.accepted = model.predicted_decrease > 0.0 && gain > kMinGain;
    if (step.accepted) {
      const double t = 2.0 * gain - 1.0;
      radius_ = std::min(kMaxRadius, radius_ / std::max(1.0 / 3.0, 1.0 - t * t * t));
      shrink_factor_ = 2.0;
    } else {
      restore();
      shrink();
    }
    return step;
  }

  void shrink() {
    radius_ /= shrink_factor_;
    shrink_factor_ *= 2.0;
  }

  /// Adds the step to the unknowns.
  StepModel move() {
    StepModel model;
    for (std::size_t i = 0; i < layout_.unknown_count(); ++i) {
      const double d = camera_step_[static_cast<Eigen::Index>(i)];
      model.squared_length += d * d;
      model.predicted_decrease += 0.5 * d * (camera_damping(i) * d - sums_[0].gradient[i]);
    }
    for (std::size_t i = 0; i < problem_.poses.size(); ++i) {
      add_camera_step(layout_.pose_block(i), PoseState::kSize, problem_.poses[i].parameters);
    }
    for (std::size_t i = 0; i < problem_.cameras.size(); ++i) {
      add_camera_step(layout_.camera_block(i),
                      static_cast<std::size_t>(problem_.cameras[i].free_count),
                      problem_.cameras[i].parameters);
    }
    for (std::size_t i = 0; i < eliminated_.points.size(); ++i) {
      const Eigen::Vector3d d = point_step(layout_, eliminated_, i, camera_step_);
      const EliminatedPoint& point = eliminated_.points[i];
      model.squared_length += d.squaredNorm();
      model.predicted_decrease +=
          0.5 * d.dot(point.diagonal.cwiseProduct(d) / radius_ - point.gradient);
      problem_.points[i] += d;
    }
    problem_.update();
    return model;
  }

  template <std::size_t kSize>
  void add_camera_step(std::uint32_t block,
                       std::size_t count,
                       std::array<double, kSize>& parameters) const {
    for (std::size_t i = 0; block != SchurLayout::kHeld && i < count; ++i) {
      parameters[i] += camera_step_[static_cast<Eigen::Index>(kBlock * block + i)];
    }
  }

  [[nodiscard]] double parameter_norm() const {
    double sum = 0.0;
    for (const Eigen::Vector3d& point : saved_.points) {
      sum += point.squaredNorm();
    }
    for (const auto& camera : saved_.cameras) {
      for (const double value : camera) {
        sum += value * value;
      }
    }
    return std::sqrt(sum);
  }

  /// The cost at the present state; infinite for a lens without a positive focal length.
  double evaluate() {
    for (const IntrinsicsState& camera : problem_.cameras) {
      if (camera.free_count > 0 && !(camera.camera.fx_px > 0.0)) {
        return std::numeric_limits<double>::infinity();
      }
    }
    std::vector<double> costs(ranges_.size(), 0.0);
    executor_.for_each_index(ranges_.size(), [this, &costs](std::size_t piece) {
      const std::size_t last = layout_.first_observation(ranges_[piece].second);
      for (std::size_t k = layout_.first_observation(ranges_[piece].first); k < last; ++k) {
        const BundleObservation& observation = problem_.observations[k];
        const Eigen::Vector2d residual = evaluate_reprojection(problem_.poses[observation.pose],
                                                               problem_.cameras[observation.camera],
                                                               problem_.points[observation.point],
                                                               observation,
                                                               {});
        costs[piece] += 0.5 * loss_of(options_, residual.squaredNorm());
      }
    });
    double cost = 0.0;
    for (const double part : costs) {
      cost += part;
    }
    for (const PriorTerm& term : priors_) {
      cost += 0.5 * prior_residual(term) * prior_residual(term);
    }
    return cost;
  }

  void save() {
    saved_.points = problem_.points;
    saved_.poses.clear();
    saved_.cameras.clear();
    for (const PoseState& pose : problem_.poses) {
      saved_.poses.push_back(pose.parameters);
    }
    for (const IntrinsicsState& camera : problem_.cameras) {
      saved_.cameras.push_back(camera.parameters);
    }
  }

  void restore() {
    problem_.points = saved_.points;
    for (std::size_t i = 0; i < problem_.poses.size(); ++i) {
      problem_.poses[i].parameters = saved_.poses[i];
    }
    for (std::size_t i = 0; i < problem_.cameras.size(); ++i) {
      problem_.cameras[i].parameters = saved_.cameras[i];
    }
    problem_.update();
  }

  BundleProblem& problem_;
  const BundleOptions& options_;
  Executor& executor_;
  SchurLayout layout_;
  std::vector<std::pair<std::size_t, std::size_t>> ranges_;  // of points
  std::vector<PriorTerm> priors_;
  std::vector<SchurSums> sums_;  // by range; the first holds the total after linearize()
  SchurPoints eliminated_;
  Eigen::MatrixXd reduced_;
  Eigen::VectorXd camera_step_;
  Unknowns saved_;
  double radius_ = kFirstRadius;
  double shrink_factor_ = 2.0;
};

}  // namespace

SolverSummary solve_with_schur(BundleProblem& problem,
                               const BundleOptions& options,
                               Executor& executor) {
  return SchurSolver(problem, options, executor).solve();
}

}  // namespace trigmesh
