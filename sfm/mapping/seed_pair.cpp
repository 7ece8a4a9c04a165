#include "sfm/mapping/seed_pair.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

#include <Eigen/SVD>

#include "sfm/geometry/triangulation.hpp"

namespace trigmesh {

namespace {

// The strongest pairs are tried, no more.
constexpr std::size_t kMaxPairsTried = 60;
// More than this many matches say nothing new about a pair.
constexpr std::size_t kMaxMatchesJudged = 400;
// Beyond this angle a larger one does not make a point better.
constexpr double kAngleCapRad = 16.0 * std::numbers::pi / 180.0;

std::vector<const PairRecord*> strongest_free_pairs(const ImageStore& store) {
  std::vector<const PairRecord*> pairs;
  for (const PairRecord& record : store.pairs) {
    const bool usable = record.geometry.kind == TwoViewKind::kGeneral || record.geometry.kind == TwoViewKind::kPlanar;
    const bool free = !store.images[index(record.pair.first)].registered &&
                      !store.images[index(record.pair.second)].registered;
    if (usable && free) {
      pairs.push_back(&record);
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const PairRecord* a, const PairRecord* b) {
    return a->geometry.inliers.size() > b->geometry.inliers.size();
  });
  pairs.resize(std::min(pairs.size(), kMaxPairsTried));
  return pairs;
}

struct ScoredSeed {
  SeedPair seed;
  double score = 0.0;
};

std::array<Rigid3, 4> decompose(const Eigen::Matrix3d& essential) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  Eigen::Matrix3d v = svd.matrixV();
  if (u.determinant() < 0) {
    u = -u;
  }
  if (v.determinant() < 0) {
    v = -v;
  }
  Eigen::Matrix3d w;
  w << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Quaterniond r1(Eigen::Matrix3d(u * w * v.transpose()));
  const Eigen::Quaterniond r2(Eigen::Matrix3d(u * w.transpose() * v.transpose()));
  const Eigen::Vector3d t = u.col(2);
  return {Rigid3{r1, t}, Rigid3{r1, -t}, Rigid3{r2, t}, Rigid3{r2, -t}};
}

std::optional<ScoredSeed> judge(const ImageStore& store, const PairRecord& record, std::span<const Camera> cameras,
                                const MapperOptions& options) {
  const ImageRecord& a = store.images[index(record.pair.first)];
  const ImageRecord& b = store.images[index(record.pair.second)];
  const Camera& ca = cameras[index(a.camera)];
  const Camera& cb = cameras[index(b.camera)];
  const Eigen::Matrix3d e = cb.calibration_matrix().transpose() * record.geometry.fundamental * ca.calibration_matrix();
  TriangulationOptions to;
  to.min_angle_rad = options.min_triangulation_angle_deg * std::numbers::pi / 180.0;
  to.max_error_px = 2 * options.max_reprojection_px;
  const std::size_t n = record.geometry.inliers.size();
  const std::size_t step = std::max<std::size_t>(1, n / kMaxMatchesJudged);
  std::optional<ScoredSeed> best;
  for (const Rigid3& pose : decompose(e)) {
    ScoredSeed s;
    std::vector<double> angles;
    for (std::size_t i = 0; i < n; i += step) {
      const auto& m = record.geometry.inliers[i];
      const auto s1 = make_sighting(ca, Rigid3{}, a.keypoints_px[index(m.first)].cast<double>());
      const auto s2 = make_sighting(cb, pose, b.keypoints_px[index(m.second)].cast<double>());
      if (!s1 || !s2) continue;
      const std::array<Sighting, 2> ss{*s1, *s2};
      const auto t = triangulate(ss, to);
      if (t.outcome == TriangulationOutcome::kOk) {
        s.score += std::min(t.angle_rad, kAngleCapRad);
        angles.push_back(t.angle_rad);
      }
    }
    s.score *= static_cast<double>(step);
    s.seed.landmarks = angles.size() * step;
    if (s.seed.landmarks < static_cast<std::size_t>(options.min_seed_landmarks)) continue;
    std::nth_element(angles.begin(), angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2), angles.end());
    s.seed.median_angle_rad = angles[angles.size() / 2];
    s.seed.pair = record.pair;
    s.seed.second_from_first = pose;
    if (!best || s.score > best->score) best = s;
  }
  return best;
}

}  // namespace

std::optional<SeedPair> choose_seed_pair(const ImageStore& store,
                                         std::span<const Camera> cameras,
                                         const MapperOptions& options,
                                         Executor& executor) {
  const std::vector<const PairRecord*> pairs = strongest_free_pairs(store);
  std::vector<std::optional<ScoredSeed>> seeds(pairs.size());
  executor.for_each_index(pairs.size(), [&](std::size_t i) { seeds[i] = judge(store, *pairs[i], cameras, options); });
  const ScoredSeed* best = nullptr;
  for (const std::optional<ScoredSeed>& seed : seeds) {
    if (seed && (best == nullptr || seed->score > best->score)) {
      best = &*seed;
    }
  }
  return best != nullptr ? std::optional(best->seed) : std::nullopt;
}

}  // namespace trigmesh
