// Bundle adjustment by Ceres (S. Agarwal, K. Mierle and others, ceres-solver.org), for reduced
// systems that are worth solving sparse, and as the second opinion on our own solver.
#include <algorithm>
#include <array>
#include <cstddef>
#include <deque>
#include <memory>
#include <vector>

#include <ceres/ceres.h>

#include "sfm/mapping/bundle_solvers.hpp"
#include "sfm/mapping/reprojection_cost.hpp"

namespace trigmesh {
namespace {

/// One observation as Ceres sees it. Blocks: pose (6), point (3) and, when solved, intrinsics
/// (kIntrinsics). Pose and intrinsics are read from the shared states, which StateUpdater keeps at
/// the parameters.
template <int... kIntrinsics>
class ReprojectionCost final
    : public ceres::SizedCostFunction<2, PoseState::kSize, 3, kIntrinsics...> {
 public:
  ReprojectionCost(const PoseState& pose,
                   const IntrinsicsState& intrinsics,
                   const BundleObservation& observation)
      : pose_(pose), intrinsics_(intrinsics), observation_(observation) {}

  bool Evaluate(const double* const* parameters,
                double* residuals,
                double** jacobians) const override {
    ReprojectionJacobians wanted;
    if (jacobians != nullptr) {
      wanted.pose = jacobians[0];
      wanted.point = jacobians[1];
      if constexpr (sizeof...(kIntrinsics) > 0) {
        wanted.intrinsics = jacobians[2];
      }
    }
    const Eigen::Map<const Eigen::Vector3d> point(parameters[1]);
    Eigen::Map<Eigen::Vector2d>{residuals} =
        evaluate_reprojection(pose_, intrinsics_, point, observation_, wanted);
    return true;
  }

 private:
  const PoseState& pose_;
  const IntrinsicsState& intrinsics_;
  const BundleObservation& observation_;
};

/// (free entries - prior) / sigma.
class IntrinsicsPrior final : public ceres::CostFunction {
 public:
  IntrinsicsPrior(const IntrinsicsState& state, const IntrinsicsFreedom& freedom)
      : block_size_(state.block_size()) {
    for (int i = 0; i < state.free_count; ++i) {
      const int entry = state.free[static_cast<std::size_t>(i)];
      const IntrinsicsPriorValue prior = prior_of_entry(freedom, entry);
      if (prior.sigma > 0.0) {
        terms_.push_back({i, prior.mean, 1.0 / prior.sigma});
      }
    }
    set_num_residuals(static_cast<int>(terms_.size()));
    mutable_parameter_block_sizes()->push_back(block_size_);
  }

  [[nodiscard]] bool empty() const { return terms_.empty(); }

  bool Evaluate(const double* const* parameters,
                double* residuals,
                double** jacobians) const override {
    const bool wants_jacobian = jacobians != nullptr && jacobians[0] != nullptr;
    if (wants_jacobian) {
      std::fill_n(jacobians[0], terms_.size() * static_cast<std::size_t>(block_size_), 0.0);
    }
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      const Term& term = terms_[i];
      residuals[i] = (parameters[0][term.parameter] - term.mean) * term.inverse_sigma;
      if (wants_jacobian) {
        jacobians[0][i * static_cast<std::size_t>(block_size_) +
                     static_cast<std::size_t>(term.parameter)] = term.inverse_sigma;
      }
    }
    return true;
  }

 private:
  struct Term {
    int parameter = 0;
    double mean = 0.0;
    double inverse_sigma = 0.0;
  };

  int block_size_ = 0;
  std::vector<Term> terms_;
};

/// Once per evaluation, instead of once per observation: rotation matrices and lens parameters.
class StateUpdater final : public ceres::EvaluationCallback {
 public:
  explicit StateUpdater(BundleProblem& problem) : problem_(problem) {}

  void PrepareForEvaluation(bool /*evaluate_jacobians*/, bool new_evaluation_point) override {
    if (new_evaluation_point) {
      problem_.update();
    }
  }

 private:
  BundleProblem& problem_;
};

std::unique_ptr<ceres::LossFunction> create_loss(const BundleOptions& options) {
  switch (options.loss) {
    case RobustLoss::kNone:
      break;
    case RobustLoss::kHuber:
      return std::make_unique<ceres::HuberLoss>(options.loss_scale_px);
    case RobustLoss::kSoftL1:
      return std::make_unique<ceres::SoftLOneLoss>(options.loss_scale_px);
    case RobustLoss::kCauchy:
      return std::make_unique<ceres::CauchyLoss>(options.loss_scale_px);
  }
  return nullptr;
}

/// Owns the Ceres problem and everything that it points to; refers to the states in a
/// BundleProblem.
class CeresBundle {
 public:
  CeresBundle(BundleProblem& problem, const BundleOptions& options)
      : problem_(problem),
        options_(options),
        updater_(problem),
        loss_(create_loss(options)),
        ceres_problem_(problem_options(updater_)) {
    add_blocks();
    add_observations();
    add_priors();
  }

  ceres::Solver::Summary solve() {
    ceres::Solver::Summary summary;
    ceres::Solve(solver_options(), &ceres_problem_, &summary);
    problem_.update();
    return summary;
  }

 private:
  static ceres::Problem::Options problem_options(StateUpdater& updater) {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    options.evaluation_callback = &updater;
    return options;
  }

  /// Groups: points are eliminated first; poses and intrinsics apart, because within a group Ceres
  /// orders by address.
  void add_blocks() {
    ordering_ = std::make_shared<ceres::ParameterBlockOrdering>();
    for (Eigen::Vector3d& point : problem_.points) {
      ceres_problem_.AddParameterBlock(point.data(), 3);
      ordering_->AddElementToGroup(point.data(), 0);
      if (!problem_.points_are_variable) {
        ceres_problem_.SetParameterBlockConstant(point.data());
      }
    }
    for (std::size_t i = 0; i < problem_.poses.size(); ++i) {
      double* const block = problem_.poses[i].parameters.data();
      if (problem_.pose_observations[i] == 0) {
        continue;
      }
      ceres_problem_.AddParameterBlock(block, PoseState::kSize);
      ordering_->AddElementToGroup(block, 1);
      if (problem_.pose_is_variable[i] == 0) {
        ceres_problem_.SetParameterBlockConstant(block);
      }
    }
    for (std::size_t i = 0; i < problem_.cameras.size(); ++i) {
      IntrinsicsState& camera = problem_.cameras[i];
      if (camera.free_count > 0 && problem_.camera_observations[i] > 0) {
        ceres_problem_.AddParameterBlock(camera.parameters.data(), camera.block_size());
        ordering_->AddElementToGroup(camera.parameters.data(), 2);
      }
    }
  }

  void add_observations() {
    for (const BundleObservation& observation : problem_.observations) {
      PoseState& pose = problem_.poses[observation.pose];
      IntrinsicsState& camera = problem_.cameras[observation.camera];
      double* const pose_block = pose.parameters.data();
      double* const point_block = problem_.points[observation.point].data();
      double* const intrinsics_block = camera.parameters.data();
      if (camera.block_size() == 0) {
        auto& cost = fixed_costs_.emplace_back(pose, camera, observation);
        ceres_problem_.AddResidualBlock(&cost, loss_.get(), pose_block, point_block);
      } else if (camera.block_size() == IntrinsicsState::kSmallSize) {
        auto& cost = small_costs_.emplace_back(pose, camera, observation);
        ceres_problem_.AddResidualBlock(
            &cost, loss_.get(), pose_block, point_block, intrinsics_block);
      } else {
        auto& cost = full_costs_.emplace_back(pose, camera, observation);
        ceres_problem_.AddResidualBlock(
            &cost, loss_.get(), pose_block, point_block, intrinsics_block);
      }
    }
  }

  void add_priors() {
    for (std::size_t i = 0; i < problem_.cameras.size(); ++i) {
      IntrinsicsState& camera = problem_.cameras[i];
      if (camera.free_count == 0 || problem_.camera_observations[i] == 0) {
        continue;
      }
      const auto& prior =
          priors_.emplace_back(std::make_unique<IntrinsicsPrior>(camera, options_.intrinsics[i]));
      if (!prior->empty()) {
        ceres_problem_.AddResidualBlock(prior.get(), nullptr, camera.parameters.data());
      }
    }
  }

  [[nodiscard]] ceres::Solver::Options solver_options() const {
    const auto variable_poses = static_cast<int>(problem_.variable_pose_count());
    const bool dense = variable_poses <= options_.dense_views;
    ceres::Solver::Options solver;
    solver.max_num_iterations = options_.max_iterations;
    solver.function_tolerance = options_.function_tolerance;
    solver.parameter_tolerance = options_.parameter_tolerance;
    solver.logging_type = ceres::SILENT;
    solver.num_threads = 1;  // the parallel Schur elimination sums in changing order
    solver.dense_linear_algebra_library_type = ceres::EIGEN;
    if (problem_.points_are_variable) {
      solver.linear_solver_type = dense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
      solver.linear_solver_ordering = ordering_;
    } else {
      solver.linear_solver_type = variable_poses <= kDenseNormalViews
                                      ? ceres::DENSE_NORMAL_CHOLESKY
                                      : ceres::SPARSE_NORMAL_CHOLESKY;
    }
    return solver;
  }

  /// Without points to eliminate the dense Jacobian has a column for every pose parameter.
  static constexpr int kDenseNormalViews = 4;

  BundleProblem& problem_;
  const BundleOptions& options_;
  StateUpdater updater_;
  std::unique_ptr<ceres::LossFunction> loss_;
  std::deque<ReprojectionCost<>> fixed_costs_;
  std::deque<ReprojectionCost<IntrinsicsState::kSmallSize>> small_costs_;
  std::deque<ReprojectionCost<IntrinsicsState::kFullSize>> full_costs_;
  std::vector<std::unique_ptr<IntrinsicsPrior>> priors_;
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_;
  ceres::Problem ceres_problem_;
};

BundleOutcome outcome_of(const ceres::Solver::Summary& summary) {
  if (!summary.IsSolutionUsable()) {
    return BundleOutcome::kFailed;
  }
  return summary.termination_type == ceres::NO_CONVERGENCE ? BundleOutcome::kMaxIterations
                                                           : BundleOutcome::kConverged;
}

}  // namespace

SolverSummary solve_with_ceres(BundleProblem& problem, const BundleOptions& options) {
  const ceres::Solver::Summary ceres_summary = CeresBundle(problem, options).solve();
  SolverSummary summary;
  summary.outcome = outcome_of(ceres_summary);
  summary.iterations = static_cast<int>(ceres_summary.iterations.size()) - 1;
  summary.initial_cost = ceres_summary.initial_cost;
  summary.final_cost = ceres_summary.final_cost;
  return summary;
}

}  // namespace trigmesh
