// Checkerboard PatchMatch with adaptive sampling of neighbours and a view selection per pixel:
//   C. Barnes et al., "PatchMatch: a randomized correspondence algorithm for structural image
//   editing", SIGGRAPH 2009;
//   S. Galliani, K. Lasinger, K. Schindler, "Massively parallel multiview stereopsis by surface
//   normal diffusion" (Gipuma), ICCV 2015: red-black order;
//   Q. Xu and W. Tao, "Multi-scale geometric consistency guided multi-view stereo" (ACMM), CVPR
//   2019, sections 3.1-3.3: sampling regions, costs of all hypotheses in all views decide which
//   views count, geometric consistency.
// The small random steps of these are replaced by one step of a parabola along inverse depth and
// both slopes, which needs fewer evaluations and ends at sub-pixel minima.
#include "sfm/dense/patch_match_sweep.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "firmware/base/check.hpp"
#include "sfm/dense/reference_patch.hpp"

namespace trigmesh {

namespace {

constexpr std::size_t kMaxHypotheses = 16;
/// Costs around 0.42 halve-and-more the say of a view: exp(-m^2 / kViewSoftness), ACMM equation 5.
constexpr float kViewSoftness = 0.18F;
/// A view with less than this part of the best view's say is not evaluated.
constexpr float kSmallestShare = 0.1F;
/// The second best view keeps at least this share: one view alone proves nothing.
constexpr float kSecondViewShare = 0.3F;
/// Truncation of the round-trip error, ACMM section 3.4.
constexpr float kMaxRoundTrip_px = 3.0F;
/// Steepest surface: |slope| f / q, about the tangent of the angle to the viewing ray.
constexpr float kMaxTangent = 5.0F;
/// A match so bad that a fine search looks everywhere too.
constexpr float kDoubtfulCost = 0.4F;
/// Variance of a patch, grey levels squared, below which nothing but the neighbours is tried.
constexpr float kBlankVariance = 0.5F;
/// Rows handed to a worker at once.
constexpr int kBandRows = 8;

/// Counter-based random numbers (SplitMix64: G. Steele, D. Lea, C. Flood, "Fast splittable
/// pseudorandom number generators", OOPSLA 2014): no state is shared between pixels.
class PixelRandom {
 public:
  PixelRandom(std::uint64_t seed, std::size_t pixel)
      : state_(mix(seed * 0x9E3779B97F4A7C15ULL) ^ (pixel * 0xD1342543DE82EF95ULL)) {}

  /// Uniform in [0, 1).
  float uniform() {
    state_ += 0x9E3779B97F4A7C15ULL;
    return static_cast<float>(mix(state_) >> 40U) * 0x1p-24F;
  }

  /// Uniform in [-1, 1).
  float symmetric() { return 2.0F * uniform() - 1.0F; }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  }

  std::uint64_t state_;
};

struct PixelOffset {
  int x;
  int y;
};

/// Where neighbours are looked for, upwards; the other three directions by rotation. All have the
/// other colour. Near: a V; far: a strip. ACMM figure 2, shortened.
constexpr std::array<PixelOffset, 7> kNearUp{
    {{0, -1}, {-1, -2}, {1, -2}, {-2, -3}, {2, -3}, {-3, -4}, {3, -4}}};
constexpr std::array<PixelOffset, 6> kFarUp{
    {{0, -3}, {0, -5}, {0, -7}, {0, -9}, {0, -11}, {0, -15}}};

PixelOffset rotated(const PixelOffset& offset, int quarter_turns) {
  switch (quarter_turns) {
    case 1:
      return {-offset.y, offset.x};
    case 2:
      return {-offset.x, -offset.y};
    case 3:
      return {offset.y, -offset.x};
    default:
      return offset;
  }
}

/// Hypotheses of a pixel and their costs in its views.
struct Candidates {
  std::array<PlaneHypothesis, kMaxHypotheses> planes;
  std::size_t count = 0;

  void add(const PlaneHypothesis& plane) {
    if (count < planes.size()) {
      planes[count++] = plane;
    }
  }

  [[nodiscard]] std::span<const PlaneHypothesis> used() const {
    return std::span(planes).first(count);
  }
};

/// The place of a parabola's minimum through values at -1, 0, 1; 0 when it opens downwards.
float parabola_minimum(float before, float here, float after) {
  const float curvature = before - 2.0F * here + after;
  constexpr float kFlat = 1e-6F;
  return curvature > kFlat ? std::clamp(0.5F * (before - after) / curvature, -1.5F, 1.5F) : 0.0F;
}

/// Work on one pixel at a time; one object a worker.
class PixelSolver {
 public:
  PixelSolver(const SweepPlan& plan, PlaneField& field)
      : plan_(plan), level_(*plan.level), field_(field), patches_(level_.grey, plan.grey_sigma) {}

  void initialize(int x, int y);
  void update(int x, int y);

 private:
  void enter(int x, int y);
  void evaluate(const Candidates& candidates);
  void collect_neighbors(Candidates& candidates) const;
  void add_if_new(const PlaneHypothesis& plane, Candidates& candidates) const;
  void weigh_views(std::size_t candidate_count);
  void keep_active_views();
  void search(PixelRandom& random, PlaneHypothesis& best, float& best_cost);
  void refine(PlaneHypothesis& best, float& best_cost);
  void measure_steps();
  [[nodiscard]] float total_cost(const Candidates& candidates, std::size_t h) const;
  [[nodiscard]] PlaneHypothesis random_plane(PixelRandom& random, float q) const;
  [[nodiscard]] bool plausible(const PlaneHypothesis& plane) const;

  const SweepPlan& plan_;
  const StereoLevel& level_;
  PlaneField& field_;
  ReferencePatchMaker patches_;

  int x_ = 0;
  int y_ = 0;
  std::size_t pixel_ = 0;
  ReferencePatch patch_;
  int magnification_ = 1;
  std::size_t view_count_ = 0;  ///< of the arrays below; after keep_active_views the active ones
  std::array<SourceProjection, kMaxStereoSources> views_;
  std::array<std::size_t, kMaxStereoSources> source_of_view_{};
  std::array<float, kMaxStereoSources> share_{};  ///< of each view in the cost; they sum to 1
  std::array<float, kMaxHypotheses * kMaxStereoSources> costs_{};
  float step_inverse_depth_ = 0.0F;
  float step_slope_ = 0.0F;
};

void PixelSolver::enter(int x, int y) {
  x_ = x;
  y_ = y;
  pixel_ = field_.index(x, y);
  magnification_ = patches_.make(x, y, patch_);
  view_count_ = level_.sources.size();
  for (std::size_t s = 0; s < view_count_; ++s) {
    views_[s] = level_.project(s, static_cast<float>(x), static_cast<float>(y));
    source_of_view_[s] = s;
  }
}

void PixelSolver::evaluate(const Candidates& candidates) {
  match_costs(patch_, std::span(views_).first(view_count_), candidates.used(), costs_);
}

/// Sizes of the refinement steps at the current plane's depth.
void PixelSolver::measure_steps() {
  const float q = field_.planes[pixel_].inverse_depth;
  float sensitivity = 0.0F;  // pixels of disparity per unit of inverse depth
  for (std::size_t v = 0; v < view_count_; ++v) {
    const SourceProjection& s = views_[v];
    const float z = s.base[2] + s.epipole[2] * q;
    if (z > 0.0F) {
      const float u = (s.base[0] + s.epipole[0] * q) / z;
      const float w = (s.base[1] + s.epipole[1] * q) / z;
      sensitivity = std::max(
          sensitivity,
          std::hypot(s.epipole[0] - u * s.epipole[2], s.epipole[1] - w * s.epipole[2]) / z);
    }
  }
  constexpr float kNoBaseline = 1e-9F;
  step_inverse_depth_ = plan_.step_px / std::max(sensitivity, kNoBaseline);
  step_inverse_depth_ = std::min(step_inverse_depth_, 0.1F * q);
  step_slope_ =
      step_inverse_depth_ / (ReferencePatchMaker::kRadius_px * static_cast<float>(magnification_));
}

bool PixelSolver::plausible(const PlaneHypothesis& plane) const {
  const float q = plane.inverse_depth;
  const auto fx = static_cast<float>(level_.camera.fx_px);
  const auto fy = static_cast<float>(level_.camera.fy_px);
  return q >= plan_.range.min && q <= plan_.range.max &&
         std::abs(plane.slope_x) * fx <= kMaxTangent * q &&
         std::abs(plane.slope_y) * fy <= kMaxTangent * q;
}

void PixelSolver::add_if_new(const PlaneHypothesis& plane, Candidates& candidates) const {
  constexpr float kSameStep = 0.1F;
  const auto same = [&](const PlaneHypothesis& other) {
    return std::abs(plane.inverse_depth - other.inverse_depth) < kSameStep * step_inverse_depth_ &&
           std::abs(plane.slope_x - other.slope_x) < 2.0F * kSameStep * step_slope_ &&
           std::abs(plane.slope_y - other.slope_y) < 2.0F * kSameStep * step_slope_;
  };
  if (plausible(plane) && std::ranges::none_of(candidates.used(), same)) {
    candidates.add(plane);
  }
}

void PixelSolver::collect_neighbors(Candidates& candidates) const {
  const auto best_of = [&](std::span<const PixelOffset> region, int quarter_turns) {
    float lowest = kNoMatchCost;
    PixelOffset at{0, 0};
    for (const PixelOffset& up : region) {
      const PixelOffset offset = rotated(up, quarter_turns);
      const int x = x_ + offset.x;
      const int y = y_ + offset.y;
      if (x >= 0 && y >= 0 && x < field_.width_px && y < field_.height_px &&
          field_.cost[field_.index(x, y)] < lowest) {
        lowest = field_.cost[field_.index(x, y)];
        at = offset;
      }
    }
    if (at.x != 0 || at.y != 0) {
      PlaneHypothesis plane = field_.planes[field_.index(x_ + at.x, y_ + at.y)];
      plane.inverse_depth -=
          plane.slope_x * static_cast<float>(at.x) + plane.slope_y * static_cast<float>(at.y);
      add_if_new(plane, candidates);
    }
  };
  for (int turn = 0; turn < 4; ++turn) {
    best_of(kNearUp, turn);
    best_of(kFarUp, turn);
  }
  if (plan_.hints != nullptr) {
    for (const std::vector<PlaneHypothesis>& hint : *plan_.hints) {
      if (hint[pixel_].inverse_depth > 0.0F) {
        add_if_new(hint[pixel_], candidates);
      }
    }
  }
}

/// Shares from what the hypotheses cost in each view (its two best count) and from what the
/// neighbours of the other colour see.
void PixelSolver::weigh_views(std::size_t candidate_count) {
  std::array<int, kMaxStereoSources> seen_by_neighbors{};
  int neighbors = 0;
  for (int turn = 0; turn < 4; ++turn) {
    const PixelOffset offset = rotated(kNearUp[0], turn);
    const int x = x_ + offset.x;
    const int y = y_ + offset.y;
    if (x >= 0 && y >= 0 && x < field_.width_px && y < field_.height_px) {
      const unsigned set = field_.view_set[field_.index(x, y)];
      ++neighbors;
      for (std::size_t v = 0; v < view_count_; ++v) {
        seen_by_neighbors[v] += static_cast<int>((set >> source_of_view_[v]) & 1U);
      }
    }
  }
  float total = 0.0F;
  for (std::size_t v = 0; v < view_count_; ++v) {
    float lowest = kNoMatchCost;
    float second = kNoMatchCost;
    for (std::size_t h = 0; h < candidate_count; ++h) {
      const float cost = costs_[h * view_count_ + v];
      second = std::min(second, std::max(cost, lowest));
      lowest = std::min(lowest, cost);
    }
    const float cost = candidate_count > 1 ? 0.5F * (lowest + second) : lowest;
    const float prior = 0.1F + 0.9F * static_cast<float>(seen_by_neighbors[v]) /
                                   static_cast<float>(std::max(neighbors, 1));
    share_[v] = prior * std::exp(-cost * cost / kViewSoftness);
    total += share_[v];
  }
  for (std::size_t v = 0; v < view_count_; ++v) {
    share_[v] = total > 0.0F ? share_[v] / total : 1.0F / static_cast<float>(view_count_);
  }
}

/// Removes the views whose share is negligible and gives the rest the whole.
void PixelSolver::keep_active_views() {
  float best = 0.0F;
  float second = 0.0F;
  std::size_t second_view = 0;
  std::size_t best_view = 0;
  for (std::size_t v = 0; v < view_count_; ++v) {
    if (share_[v] > best) {
      second = best;
      second_view = best_view;
      best = share_[v];
      best_view = v;
    } else if (share_[v] > second) {
      second = share_[v];
      second_view = v;
    }
  }
  if (view_count_ > 1 && second_view != best_view) {
    share_[second_view] = std::max(share_[second_view], kSecondViewShare * best);
  }
  std::size_t kept = 0;
  float total = 0.0F;
  for (std::size_t v = 0; v < view_count_; ++v) {
    if (share_[v] >= kSmallestShare * best) {
      views_[kept] = views_[v];
      source_of_view_[kept] = source_of_view_[v];
      share_[kept] = share_[v];
      total += share_[v];
      ++kept;
    }
  }
  view_count_ = kept;
  for (std::size_t v = 0; v < kept; ++v) {
    share_[v] /= total;
  }
}

float PixelSolver::total_cost(const Candidates& candidates, std::size_t h) const {
  float total = 0.0F;
  for (std::size_t v = 0; v < view_count_; ++v) {
    float cost = costs_[h * view_count_ + v];
    const StereoSource& source = level_.sources[source_of_view_[v]];
    if (plan_.geometric_weight > 0.0F && !source.inverse_depth.empty()) {
      const std::optional<float> error = round_trip_error_px(source,
                                                             static_cast<float>(x_),
                                                             static_cast<float>(y_),
                                                             candidates.planes[h].inverse_depth);
      cost += plan_.geometric_weight * std::min(error.value_or(kMaxRoundTrip_px), kMaxRoundTrip_px);
    }
    total += share_[v] * cost;
  }
  return total;
}

PlaneHypothesis PixelSolver::random_plane(PixelRandom& random, float q) const {
  const Camera& camera = level_.camera;
  const Eigen::Vector2f pixel(static_cast<float>(x_), static_cast<float>(y_));
  const Eigen::Vector3f ray(
      (pixel.x() - static_cast<float>(camera.cx_px)) / static_cast<float>(camera.fx_px),
      (pixel.y() - static_cast<float>(camera.cy_px)) / static_cast<float>(camera.fy_px),
      1.0F);
  constexpr float kLargestTangent = 1.7F;
  const float radius = kLargestTangent * std::sqrt(random.uniform());
  const float angle = 2.0F * std::numbers::pi_v<float> * random.uniform();
  const Eigen::Vector3f normal =
      -ray.normalized() + Eigen::Vector3f(radius * std::cos(angle), radius * std::sin(angle), 0.0F);
  return plane_from_normal(camera, pixel, q, normal);
}

/// Random planes: two anywhere and one with another depth only (kWide, or a bad match), one near
/// the best (always).
void PixelSolver::search(PixelRandom& random, PlaneHypothesis& best, float& best_cost) {
  Candidates candidates;
  const float span = plan_.range.max - plan_.range.min;
  const bool wide = plan_.search == SweepSearch::kWide ||
                    best_cost > kDoubtfulCost + kMaxRoundTrip_px * plan_.geometric_weight;
  if (wide) {
    for (int k = 0; k < 2; ++k) {
      const PlaneHypothesis plane = random_plane(random, plan_.range.min + span * random.uniform());
      if (plausible(plane)) {
        candidates.add(plane);
      }
    }
    const float scale = std::exp(0.3F * random.symmetric());
    const PlaneHypothesis moved{
        best.inverse_depth * scale, best.slope_x * scale, best.slope_y * scale};
    if (plausible(moved)) {
      candidates.add(moved);
    }
  }
  const float reach = wide ? 4.0F : 2.0F;
  const PlaneHypothesis near{best.inverse_depth + reach * step_inverse_depth_ * random.symmetric(),
                             best.slope_x + reach * step_slope_ * random.symmetric(),
                             best.slope_y + reach * step_slope_ * random.symmetric()};
  if (plausible(near)) {
    candidates.add(near);
  }
  evaluate(candidates);
  for (std::size_t h = 0; h < candidates.count; ++h) {
    const float cost = total_cost(candidates, h);
    if (cost < best_cost) {
      best_cost = cost;
      best = candidates.planes[h];
    }
  }
}

/// One step along each of the three parameters to the minimum of a parabola.
void PixelSolver::refine(PlaneHypothesis& best, float& best_cost) {
  const PlaneHypothesis start = best;
  const float dq = step_inverse_depth_;
  const float ds = step_slope_;
  Candidates around;
  for (const float sign : {-1.0F, 1.0F}) {
    around.add({start.inverse_depth + sign * dq, start.slope_x, start.slope_y});
    around.add({start.inverse_depth, start.slope_x + sign * ds, start.slope_y});
    around.add({start.inverse_depth, start.slope_x, start.slope_y + sign * ds});
  }
  evaluate(around);
  std::array<float, 6> cost{};
  for (std::size_t h = 0; h < cost.size(); ++h) {
    cost[h] = total_cost(around, h);
  }
  const PlaneHypothesis moved{
      start.inverse_depth + dq * parabola_minimum(cost[0], best_cost, cost[3]),
      start.slope_x + ds * parabola_minimum(cost[1], best_cost, cost[4]),
      start.slope_y + ds * parabola_minimum(cost[2], best_cost, cost[5])};
  const float start_cost = best_cost;
  for (std::size_t h = 0; h < cost.size(); ++h) {
    if (cost[h] < best_cost && plausible(around.planes[h])) {
      best_cost = cost[h];
      best = around.planes[h];
    }
  }
  if (!plausible(moved)) {
    return;
  }
  Candidates last;
  last.add(moved);
  last.add({start.inverse_depth + dq * parabola_minimum(cost[0], start_cost, cost[3]),
            start.slope_x,
            start.slope_y});
  evaluate(last);
  for (std::size_t h = 0; h < last.count; ++h) {
    const float total = total_cost(last, h);
    if (total < best_cost && plausible(last.planes[h])) {
      best_cost = total;
      best = last.planes[h];
    }
  }
}

void PixelSolver::initialize(int x, int y) {
  enter(x, y);
  PlaneHypothesis& plane = field_.planes[pixel_];
  if (!level_.mask.empty() && level_.mask.at<std::uint8_t>(y, x) == 0) {
    plane = {};
    field_.cost[pixel_] = kNoMatchCost;
    return;
  }
  constexpr float kDoubtRatio = 0.25F;
  PixelRandom random(plan_.seed, pixel_);
  const bool doubted = plan_.search == SweepSearch::kWide && random.uniform() < kDoubtRatio;
  if (!plausible(plane) || doubted) {
    const float span = plan_.range.max - plan_.range.min;
    plane = random_plane(random, plan_.range.min + span * random.uniform());
  }
  Candidates candidates;
  candidates.add(plane);
  evaluate(candidates);
  // The better half of the views: the rest may not see the pixel.
  std::array<float, kMaxStereoSources> sorted{};
  sorted.fill(kNoMatchCost);
  std::copy_n(costs_.begin(), view_count_, sorted.begin());
  std::ranges::sort(sorted);
  const std::size_t half = (view_count_ + 1) / 2;
  float total = 0.0F;
  for (std::size_t v = 0; v < half; ++v) {
    total += sorted[v];
  }
  field_.cost[pixel_] = total / static_cast<float>(half);
  if (field_.view_set[pixel_] == 0) {
    field_.view_set[pixel_] = static_cast<std::uint8_t>((1U << level_.sources.size()) - 1U);
  }
}

void PixelSolver::update(int x, int y) {
  if (!level_.mask.empty() && level_.mask.at<std::uint8_t>(y, x) == 0) {
    return;
  }
  enter(x, y);
  measure_steps();
  Candidates candidates;
  candidates.add(field_.planes[pixel_]);
  collect_neighbors(candidates);
  evaluate(candidates);
  weigh_views(candidates.count);

  const std::size_t all_views = view_count_;
  const std::array<float, kMaxHypotheses* kMaxStereoSources> all_costs = costs_;
  keep_active_views();
  for (std::size_t h = 0; h < candidates.count; ++h) {
    for (std::size_t v = 0; v < view_count_; ++v) {
      costs_[h * view_count_ + v] = all_costs[h * all_views + source_of_view_[v]];
    }
  }
  PlaneHypothesis best = candidates.planes[0];
  float best_cost = total_cost(candidates, 0);
  for (std::size_t h = 1; h < candidates.count; ++h) {
    const float cost = total_cost(candidates, h);
    if (cost < best_cost) {
      best_cost = cost;
      best = candidates.planes[h];
    }
  }
  if (patch_.variance > kBlankVariance) {
    PixelRandom random(plan_.seed, pixel_);
    search(random, best, best_cost);
    refine(best, best_cost);
  }
  field_.planes[pixel_] = best;
  field_.cost[pixel_] = best_cost;
  unsigned set = 0;
  for (std::size_t v = 0; v < view_count_; ++v) {
    set |= 1U << source_of_view_[v];
  }
  field_.view_set[pixel_] = static_cast<std::uint8_t>(set);
}

std::size_t band_count(const PlaneField& field) {
  return static_cast<std::size_t>((field.height_px + kBandRows - 1) / kBandRows);
}

}  // namespace

void initialize_field(const SweepPlan& plan, PlaneField& field, Executor& executor) {
  TM_CHECK(plan.level->grey.cols == field.width_px && plan.level->grey.rows == field.height_px);
  executor.for_each_index(band_count(field), [&](std::size_t band) {
    PixelSolver solver(plan, field);
    const int first = static_cast<int>(band) * kBandRows;
    for (int y = first; y < std::min(first + kBandRows, field.height_px); ++y) {
      for (int x = 0; x < field.width_px; ++x) {
        solver.initialize(x, y);
      }
    }
  });
}

void sweep_field(const SweepPlan& plan, PlaneField& field, Executor& executor) {
  TM_CHECK(plan.level->grey.cols == field.width_px && plan.level->grey.rows == field.height_px);
  for (int color = 0; color < 2; ++color) {
    executor.for_each_index(band_count(field), [&](std::size_t band) {
      PixelSolver solver(plan, field);
      const int first = static_cast<int>(band) * kBandRows;
      for (int y = first; y < std::min(first + kBandRows, field.height_px); ++y) {
        for (int x = (y + color) % 2; x < field.width_px; x += 2) {
          solver.update(x, y);
        }
      }
    });
  }
}

}  // namespace trigmesh
