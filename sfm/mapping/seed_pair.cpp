#include "sfm/mapping/seed_pair.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

#include "sfm/geometry/epipolar.hpp"
#include "sfm/geometry/essential.hpp"
#include "sfm/geometry/triangulation.hpp"

namespace trigmesh {

namespace {

// The strongest pairs are tried, no more.
constexpr std::size_t kMaxPairsTried = 60;
// More than this many matches say nothing new about a pair.
constexpr std::size_t kMaxMatchesJudged = 400;
// Beyond this angle a larger one does not make a point better.
constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kAngleCapRad = 16.0 * kRadPerDeg;
// The lens may not be known yet.
constexpr double kLensSlack = 2.0;

std::vector<const PairRecord*> strongest_free_pairs(const ImageStore& store) {
  std::vector<const PairRecord*> pairs;
  for (const PairRecord& record : store.pairs) {
    const bool usable = record.geometry.kind == TwoViewKind::kGeneral ||
                        record.geometry.kind == TwoViewKind::kPlanar;
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

/// Matches of a pair that have rays: pixels and normalised coordinates.
struct SeedMatches {
  std::vector<Eigen::Vector2d> first_px;
  std::vector<Eigen::Vector2d> second_px;
  std::vector<Eigen::Vector2d> first;
  std::vector<Eigen::Vector2d> second;
};

/// An even choice of at most kMaxMatchesJudged matches.
SeedMatches collect_matches(const ImageStore& store,
                            const PairRecord& record,
                            const Camera& first,
                            const Camera& second) {
  const std::vector<FeatureMatch>& inliers = record.geometry.inliers;
  const std::size_t step = std::max<std::size_t>(1, inliers.size() / kMaxMatchesJudged);
  SeedMatches matches;
  for (std::size_t i = 0; i < inliers.size(); i += step) {
    const Eigen::Vector2d first_px =
        store.images[index(record.pair.first)].keypoints_px[index(inliers[i].first)].cast<double>();
    const Eigen::Vector2d second_px = store.images[index(record.pair.second)]
                                          .keypoints_px[index(inliers[i].second)]
                                          .cast<double>();
    const auto first_ray = normalize_pixel(first, first_px);
    const auto second_ray = normalize_pixel(second, second_px);
    if (first_ray && second_ray) {
      matches.first_px.push_back(first_px);
      matches.second_px.push_back(second_px);
      matches.first.push_back(*first_ray);
      matches.second.push_back(*second_ray);
    }
  }
  return matches;
}

/// E = K2^T F K1, decomposed, the pose with points in front of both cameras, refined on the Sampson
/// error.
std::optional<Rigid3> relative_pose(const Eigen::Matrix3d& fundamental,
                                    const SeedMatches& matches,
                                    const CalibrationPair& calibrations) {
  const Eigen::Matrix3d essential = enforce_essential(
      essential_from_fundamental(fundamental, calibrations.first, calibrations.second));
  const PoseChoice choice = choose_pose(essential, matches.first, matches.second, {}, {});
  if (choice.outcome != CheiralityOutcome::kOk) {
    return std::nullopt;
  }
  const auto straight = [](const Eigen::Matrix3d& calibration,
                           const std::vector<Eigen::Vector2d>& rays) {
    std::vector<Eigen::Vector2d> pixels;
    for (const Eigen::Vector2d& ray : rays) {
      pixels.emplace_back((calibration * ray.homogeneous()).hnormalized());
    }
    return pixels;
  };
  return refine_relative_pose(choice.second_from_first,
                              calibrations,
                              straight(calibrations.first, matches.first),
                              straight(calibrations.second, matches.second),
                              {},
                              {});
}

std::vector<double> triangulation_angles(const SeedMatches& matches,
                                         const Camera& first,
                                         const Camera& second,
                                         const Rigid3& second_from_first,
                                         const MapperOptions& options) {
  TriangulationOptions triangulation;
  triangulation.min_angle_rad = options.min_triangulation_angle_deg * kRadPerDeg;
  triangulation.max_error_px = kLensSlack * options.max_reprojection_px;
  std::vector<double> angles;
  for (std::size_t i = 0; i < matches.first.size(); ++i) {
    const auto in_first = make_sighting(first, Rigid3{}, matches.first_px[i]);
    const auto in_second = make_sighting(second, second_from_first, matches.second_px[i]);
    if (!in_first || !in_second) {
      continue;
    }
    const Triangulation point = triangulate(std::array{*in_first, *in_second}, triangulation);
    if (point.outcome == TriangulationOutcome::kOk) {
      angles.push_back(point.angle_rad);
    }
  }
  return angles;
}

std::optional<ScoredSeed> judge(const ImageStore& store,
                                const PairRecord& record,
                                std::span<const Camera> cameras,
                                const MapperOptions& options) {
  const Camera& first = cameras[index(store.images[index(record.pair.first)].camera)];
  const Camera& second = cameras[index(store.images[index(record.pair.second)].camera)];
  const SeedMatches matches = collect_matches(store, record, first, second);
  const auto pose = relative_pose(record.geometry.fundamental,
                                  matches,
                                  {first.calibration_matrix(), second.calibration_matrix()});
  if (!pose) {
    return std::nullopt;
  }
  std::vector<double> angles = triangulation_angles(matches, first, second, *pose, options);
  const double part = static_cast<double>(record.geometry.inliers.size()) /
                      static_cast<double>(matches.first.size());
  const auto landmarks = static_cast<std::size_t>(part * static_cast<double>(angles.size()));
  if (angles.empty() || landmarks < static_cast<std::size_t>(options.min_seed_landmarks)) {
    return std::nullopt;
  }
  double score = 0.0;
  for (const double angle : angles) {
    score += part * std::min(angle, kAngleCapRad);
  }
  const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
  std::nth_element(angles.begin(), middle, angles.end());
  return ScoredSeed{{record.pair, *pose, landmarks, *middle}, score};
}

}  // namespace

std::optional<SeedPair> choose_seed_pair(const ImageStore& store,
                                         std::span<const Camera> cameras,
                                         const MapperOptions& options,
                                         Executor& executor) {
  const std::vector<const PairRecord*> pairs = strongest_free_pairs(store);
  std::vector<std::optional<ScoredSeed>> seeds(pairs.size());
  executor.for_each_index(
      pairs.size(), [&](std::size_t i) { seeds[i] = judge(store, *pairs[i], cameras, options); });
  const ScoredSeed* best = nullptr;
  for (const std::optional<ScoredSeed>& seed : seeds) {
    if (seed && (best == nullptr || seed->score > best->score)) {
      best = &*seed;
    }
  }
  return best != nullptr ? std::optional(best->seed) : std::nullopt;
}

}  // namespace trigmesh
