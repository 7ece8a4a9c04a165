#include "sfm/mapping/schur_system.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace trigmesh {
namespace {

constexpr std::size_t kBlock = SchurLayout::kBlock;
constexpr std::size_t kMaxCameraBlocks = 2;
/// Least diagonal that damping is taken from: a point that no observation sees any more stays where
/// it is.
constexpr double kMinDiagonal = 1e-12;

double* block_at(std::vector<double>& blocks, std::size_t row, std::size_t column) {
  return blocks.data() + 36 * (row * (row + 1) / 2 + column);
}

// The kernels below take most of the time. Two lanes at once, written out: compilers do not find
// them by themselves. Every processor has two lanes of double, so that the sums, and with them the
// bits, are the same everywhere.
using Lanes = double __attribute__((vector_size(16)));

Lanes load(const double* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

void store(const Lanes& lanes, double* to) {
  std::memcpy(to, &lanes, sizeof(lanes));
}

/// out += a^T b, both two rows of six.
void add_outer2(const double* a, const double* b, double* out) {
  const std::array<Lanes, 3> b0 = {load(b), load(b + 2), load(b + 4)};
  const std::array<Lanes, 3> b1 = {load(b + 6), load(b + 8), load(b + 10)};
  for (std::size_t i = 0; i < kBlock; ++i) {
    double* const row = out + kBlock * i;
    const double a0 = a[i];
    const double a1 = a[kBlock + i];
    for (std::size_t j = 0; j < 3; ++j) {
      store(load(row + 2 * j) + (a0 * b0[j] + a1 * b1[j]), row + 2 * j);
    }
  }
}

/// out -= a^T b, both three rows of six.
void subtract_outer3(const double* a, const double* b, double* out) {
  const std::array<Lanes, 3> b0 = {load(b), load(b + 2), load(b + 4)};
  const std::array<Lanes, 3> b1 = {load(b + 6), load(b + 8), load(b + 10)};
  const std::array<Lanes, 3> b2 = {load(b + 12), load(b + 14), load(b + 16)};
  for (std::size_t i = 0; i < kBlock; ++i) {
    double* const row = out + kBlock * i;
    const double a0 = a[i];
    const double a1 = a[kBlock + i];
    const double a2 = a[2 * kBlock + i];
    for (std::size_t j = 0; j < 3; ++j) {
      store(load(row + 2 * j) - (a0 * b0[j] + a1 * b1[j] + a2 * b2[j]), row + 2 * j);
    }
  }
}

/// W^T += B^T A: out three rows of six, `point` (B) two rows of three, a two rows of six.
void add_coupling(const double* point, const double* a, double* out) {
  for (std::size_t j = 0; j < kBlock; j += 2) {
    const Lanes a0 = load(a + j);
    const Lanes a1 = load(a + kBlock + j);
    for (std::size_t i = 0; i < 3; ++i) {
      double* const at = out + kBlock * i + j;
      store(load(at) + (point[i] * a0 + point[3 + i] * a1), at);
    }
  }
}

/// W^T -> Z^T = L^-1 W^T, in place, three rows of six.
void solve_coupling(const std::array<double, 6>& l, double* e) {
  const double i0 = 1.0 / l[0];
  const double i1 = 1.0 / l[2];
  const double i2 = 1.0 / l[5];
  for (std::size_t j = 0; j < kBlock; j += 2) {
    const Lanes z0 = load(e + j) * i0;
    const Lanes z1 = (load(e + kBlock + j) - l[1] * z0) * i1;
    const Lanes z2 = (load(e + 2 * kBlock + j) - l[3] * z0 - l[4] * z1) * i2;
    store(z0, e + j);
    store(z1, e + kBlock + j);
    store(z2, e + 2 * kBlock + j);
  }
}

/// One weighted residual with its derivatives: rows of six, three and six per intrinsics block.
struct Row2 {
  Eigen::Vector2d residual;
  std::array<double, 2 * kBlock> pose;
  std::array<double, 6> point;
  std::array<std::array<double, 2 * kBlock>, kMaxCameraBlocks> camera;
};

/// From rows of `size` (6 or 7) to padded blocks of six.
void split_camera_rows(const double* rows, int size, Row2& out) {
  const auto width = static_cast<std::size_t>(size);
  for (auto& block : out.camera) {
    block.fill(0.0);
  }
  for (std::size_t row = 0; row < 2; ++row) {
    for (std::size_t i = 0; i < width; ++i) {
      out.camera[i / kBlock][row * kBlock + i % kBlock] = rows[row * width + i];
    }
  }
}

/// Linearises the observations of one point at a time.
class PointEliminator {
 public:
  PointEliminator(const BundleProblem& problem,
                  const BundleOptions& options,
                  const SchurLayout& layout,
                  double damping,
                  SchurPoints& out,
                  SchurSums& sums)
      : problem_(problem),
        options_(options),
        layout_(layout),
        damping_(damping),
        out_(out),
        sums_(sums) {}

  void eliminate(std::size_t point) {
    SchurEntry* const entries = out_.entries.data() + layout_.first_entry(point);
    const std::size_t entry_count = layout_.first_entry(point + 1) - layout_.first_entry(point);
    std::fill_n(entries, entry_count, SchurEntry{});
    hessian_.fill(0.0);
    gradient_.setZero();
    std::size_t next_entry = 0;
    for (std::size_t k = layout_.first_observation(point); k < layout_.first_observation(point + 1);
         ++k) {
      add_observation(k, entries, next_entry);
    }
    if (!problem_.points_are_variable) {
      return;
    }
    EliminatedPoint& eliminated = out_.points[point];
    eliminated.gradient = gradient_;
    eliminated.diagonal = {hessian_[0], hessian_[2], hessian_[5]};
    if (!factorize(eliminated)) {
      std::fill_n(entries, entry_count, SchurEntry{});
      return;
    }
    for (std::size_t i = 0; i < entry_count; ++i) {
      solve_coupling(eliminated.factor, entries[i].data());
    }
    subtract_point(entries, entry_count, layout_.first_entry(point), eliminated.half_step);
  }

 private:
  void add_observation(std::size_t k, SchurEntry* entries, std::size_t& next_entry) {
    const BundleObservation& observation = problem_.observations[k];
    const std::uint32_t pose_block = layout_.pose_block(observation.pose);
    const std::uint32_t camera_block = layout_.camera_block(observation.camera);
    const bool pose_moves = pose_block != SchurLayout::kHeld;
    const bool camera_moves = camera_block != SchurLayout::kHeld;
    linearize(observation, pose_moves, camera_moves);
    if (problem_.points_are_variable) {
      add_point_terms();
    }
    if (pose_moves) {
      const double* a = row_.pose.data();
      add_outer2(a, a, block_at(sums_.blocks, pose_block, pose_block));
      add_block_terms(row_.pose, pose_block, entries + next_entry);
      ++next_entry;
    }
    if (camera_moves) {
      add_camera_terms(observation, pose_block, entries + layout_.camera_entry(k));
    }
  }

  void linearize(const BundleObservation& observation, bool pose_moves, bool camera_moves) {
    const IntrinsicsState& camera = problem_.cameras[observation.camera];
    std::array<double, 2 * IntrinsicsState::kFullSize> camera_rows;
    ReprojectionJacobians wanted;
    wanted.pose = pose_moves ? row_.pose.data() : nullptr;
    wanted.point = row_.point.data();
    wanted.intrinsics = camera_moves ? camera_rows.data() : nullptr;
    row_.residual = evaluate_reprojection(problem_.poses[observation.pose],
                                          camera,
                                          problem_.points[observation.point],
                                          observation,
                                          wanted);
    if (camera_moves) {
      split_camera_rows(camera_rows.data(), camera.block_size(), row_);
    }
    scale(std::sqrt(loss_weight(options_, row_.residual.squaredNorm())), camera_moves);
  }

  void scale(double factor, bool camera_moves) {
    row_.residual *= factor;
    for (double& value : row_.pose) {
      value *= factor;
    }
    for (double& value : row_.point) {
      value *= factor;
    }
    for (std::size_t i = 0; camera_moves && i < row_.camera.size(); ++i) {
      for (double& value : row_.camera[i]) {
        value *= factor;
      }
    }
  }

  void add_point_terms() {
    const double* b0 = row_.point.data();
    const double* b1 = b0 + 3;
    std::size_t at = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        hessian_[at++] += b0[i] * b0[j] + b1[i] * b1[j];
      }
      gradient_[static_cast<Eigen::Index>(i)] +=
          b0[i] * row_.residual.x() + b1[i] * row_.residual.y();
    }
  }

  /// Gradient, diagonal and W of one block of six.
  void add_block_terms(const std::array<double, 2 * kBlock>& rows,
                       std::size_t block,
                       SchurEntry* entry) {
    const double* a0 = rows.data();
    const double* a1 = a0 + kBlock;
    double* const gradient = sums_.gradient.data() + kBlock * block;
    double* const diagonal = sums_.diagonal.data() + kBlock * block;
    for (std::size_t i = 0; i < kBlock; ++i) {
      gradient[i] += a0[i] * row_.residual.x() + a1[i] * row_.residual.y();
      diagonal[i] += a0[i] * a0[i] + a1[i] * a1[i];
    }
    if (problem_.points_are_variable) {
      add_coupling(row_.point.data(), a0, entry->data());
    }
  }

  void add_camera_terms(const BundleObservation& observation,
                        std::uint32_t pose_block,
                        SchurEntry* entries) {
    const std::size_t first = layout_.camera_block(observation.camera);
    const std::size_t count = layout_.camera_block_count(observation.camera);
    for (std::size_t i = 0; i < count; ++i) {
      const double* c = row_.camera[i].data();
      if (pose_block != SchurLayout::kHeld) {
        const double* a = row_.pose.data();
        add_outer2(c, a, block_at(sums_.blocks, first + i, pose_block));
      }
      for (std::size_t j = 0; j <= i; ++j) {
        const double* other = row_.camera[j].data();
        add_outer2(c, other, block_at(sums_.blocks, first + i, first + j));
      }
      add_block_terms(row_.camera[i], first + i, entries + i);
    }
  }

  /// L and L^-1 gp of the damped Hessian; false when it is not positive: the point is held for this
  /// step.
  bool factorize(EliminatedPoint& point) const {
    const auto damped = [this](double d) { return d + damping_ * std::max(d, kMinDiagonal); };
    auto& l = point.factor;
    l[0] = std::sqrt(damped(hessian_[0]));
    l[1] = hessian_[1] / l[0];
    l[2] = std::sqrt(damped(hessian_[2]) - l[1] * l[1]);
    l[3] = hessian_[3] / l[0];
    l[4] = (hessian_[4] - l[3] * l[1]) / l[2];
    l[5] = std::sqrt(damped(hessian_[5]) - l[3] * l[3] - l[4] * l[4]);
    if (!(l[0] > 0.0 && l[2] > 0.0 && l[5] > 0.0)) {
      l.fill(0.0);
      point.half_step.setZero();
      return false;
    }
    Eigen::Vector3d& h = point.half_step;
    h[0] = gradient_[0] / l[0];
    h[1] = (gradient_[1] - l[1] * h[0]) / l[2];
    h[2] = (gradient_[2] - l[3] * h[0] - l[4] * h[1]) / l[5];
    return true;
  }

  void subtract_point(const SchurEntry* entries,
                      std::size_t count,
                      std::size_t first_entry,
                      const Eigen::Vector3d& half_step) {
    for (std::size_t r = 0; r < count; ++r) {
      const std::size_t row = layout_.entry_block(first_entry + r);
      const double* z = entries[r].data();
      double* const reduction = sums_.reduction.data() + kBlock * row;
      for (std::size_t i = 0; i < kBlock; ++i) {
        reduction[i] +=
            z[i] * half_step[0] + z[kBlock + i] * half_step[1] + z[2 * kBlock + i] * half_step[2];
      }
      for (std::size_t c = 0; c <= r; ++c) {
        subtract_outer3(z,
                        entries[c].data(),
                        block_at(sums_.blocks, row, layout_.entry_block(first_entry + c)));
      }
    }
  }

  const BundleProblem& problem_;
  const BundleOptions& options_;
  const SchurLayout& layout_;
  double damping_;
  SchurPoints& out_;
  SchurSums& sums_;
  Row2 row_{};
  std::array<double, 6> hessian_{};  // V by rows of its lower triangle
  Eigen::Vector3d gradient_ = Eigen::Vector3d::Zero();
};

}  // namespace

SchurLayout::SchurLayout(const BundleProblem& problem) {
  number_blocks(problem);
  first_observation_.assign(problem.points.size() + 1, problem.observations.size());
  for (std::size_t k = problem.observations.size(); k-- > 0;) {
    first_observation_[problem.observations[k].point] = k;
  }
  camera_entry_.assign(problem.observations.size(), 0);
  for (std::size_t j = 0; j < problem.points.size(); ++j) {
    first_entry_.push_back(entry_block_.size());
    for (std::size_t k = first_observation_[j]; k < first_observation_[j + 1]; ++k) {
      const std::uint32_t block = pose_block_[problem.observations[k].pose];
      if (block != kHeld) {
        entry_block_.push_back(block);
      }
    }
    add_camera_entries(problem, j);
  }
  first_entry_.push_back(entry_block_.size());
}

void SchurLayout::number_blocks(const BundleProblem& problem) {
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const bool moves = problem.pose_is_variable[i] != 0 && problem.pose_observations[i] > 0;
    pose_block_.push_back(moves ? static_cast<std::uint32_t>(block_count_++) : kHeld);
  }
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    const auto size = static_cast<std::size_t>(problem.cameras[i].block_size());
    const bool moves = size > 0 && problem.camera_observations[i] > 0;
    camera_block_.push_back(moves ? static_cast<std::uint32_t>(block_count_) : kHeld);
    camera_block_count_.push_back(moves ? (size + kBlock - 1) / kBlock : 0);
    block_count_ += camera_block_count_.back();
  }
}

/// One run of entries for each camera that sees the point, cameras ascending.
void SchurLayout::add_camera_entries(const BundleProblem& problem, std::size_t point) {
  for (std::size_t camera = 0; camera < camera_block_.size(); ++camera) {
    if (camera_block_[camera] == kHeld) {
      continue;
    }
    bool seen = false;
    const auto entry = static_cast<std::uint32_t>(entry_block_.size() - first_entry_[point]);
    for (std::size_t k = first_observation_[point]; k < first_observation_[point + 1]; ++k) {
      if (problem.observations[k].camera == camera) {
        camera_entry_[k] = entry;
        seen = true;
      }
    }
    for (std::size_t i = 0; seen && i < camera_block_count_[camera]; ++i) {
      entry_block_.push_back(camera_block_[camera] + static_cast<std::uint32_t>(i));
    }
  }
}

void SchurSums::reset(std::size_t block_count) {
  blocks.assign(36 * (block_count * (block_count + 1) / 2), 0.0);
  gradient.assign(kBlock * block_count, 0.0);
  reduction.assign(kBlock * block_count, 0.0);
  diagonal.assign(kBlock * block_count, 0.0);
}

void SchurSums::add(const SchurSums& other) {
  const auto add_vector = [](const std::vector<double>& from, std::vector<double>& to) {
    for (std::size_t i = 0; i < to.size(); ++i) {
      to[i] += from[i];
    }
  };
  add_vector(other.blocks, blocks);
  add_vector(other.gradient, gradient);
  add_vector(other.reduction, reduction);
  add_vector(other.diagonal, diagonal);
}

double loss_of(const BundleOptions& options, double s) {
  const double b = options.loss_scale_px * options.loss_scale_px;
  switch (options.loss) {
    case RobustLoss::kNone:
      break;
    case RobustLoss::kHuber:
      return s > b ? 2.0 * options.loss_scale_px * std::sqrt(s) - b : s;
    case RobustLoss::kSoftL1:
      return 2.0 * b * (std::sqrt(1.0 + s / b) - 1.0);
    case RobustLoss::kCauchy:
      return b * std::log1p(s / b);
  }
  return s;
}

double loss_weight(const BundleOptions& options, double s) {
  const double b = options.loss_scale_px * options.loss_scale_px;
  switch (options.loss) {
    case RobustLoss::kNone:
      break;
    case RobustLoss::kHuber:
      return s > b ? options.loss_scale_px / std::sqrt(s) : 1.0;
    case RobustLoss::kSoftL1:
      return 1.0 / std::sqrt(1.0 + s / b);
    case RobustLoss::kCauchy:
      return 1.0 / (1.0 + s / b);
  }
  return 1.0;
}

void eliminate_points(const BundleProblem& problem,
                      const BundleOptions& options,
                      const SchurLayout& layout,
                      double damping,
                      std::pair<std::size_t, std::size_t> range,
                      SchurPoints& out,
                      SchurSums& sums) {
  PointEliminator eliminator(problem, options, layout, damping, out, sums);
  for (std::size_t point = range.first; point < range.second; ++point) {
    eliminator.eliminate(point);
  }
}

Eigen::Vector3d point_step(const SchurLayout& layout,
                           const SchurPoints& eliminated,
                           std::size_t point,
                           const Eigen::VectorXd& camera_step) {
  const EliminatedPoint& p = eliminated.points[point];
  const auto& l = p.factor;
  if (!(l[0] > 0.0)) {
    return Eigen::Vector3d::Zero();
  }
  Eigen::Vector3d t = p.half_step;
  for (std::size_t e = layout.first_entry(point); e < layout.first_entry(point + 1); ++e) {
    const double* step = camera_step.data() + kBlock * layout.entry_block(e);
    const double* z = eliminated.entries[e].data();
    for (std::size_t i = 0; i < kBlock; ++i) {
      t[0] += z[i] * step[i];
      t[1] += z[kBlock + i] * step[i];
      t[2] += z[2 * kBlock + i] * step[i];
    }
  }
  Eigen::Vector3d x;
  x[2] = t[2] / l[5];
  x[1] = (t[1] - l[4] * x[2]) / l[2];
  x[0] = (t[0] - l[1] * x[1] - l[3] * x[2]) / l[0];
  return -x;
}

}  // namespace trigmesh
