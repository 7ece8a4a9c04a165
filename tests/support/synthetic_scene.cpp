#include "tests/support/synthetic_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/core.h>

#include "tests/support/random.hpp"

namespace trigmesh::test_support {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;
constexpr double kComponentSpacing = 1000.0;
constexpr std::size_t kNoPoint = std::numeric_limits<std::size_t>::max();

/// A point of the world before anyone has seen it.
struct WorldPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< zero: visible from everywhere
  int plane = -1;                                    ///< which plane it lies on; -1: none
};

WorldPoint box_point(Random& random, double half) {
  const auto face = random.below(6);
  const auto axis = static_cast<Eigen::Index>(face / 2);
  const double side = face % 2 == 0 ? 1.0 : -1.0;
  WorldPoint point;
  for (Eigen::Index i = 0; i < 3; ++i) {
    point.position[i] = i == axis ? side * half : random.uniform(-half, half);
  }
  point.normal[axis] = side;
  point.plane = static_cast<int>(face);
  return point;
}

WorldPoint two_planes_point(Random& random, double half) {
  const int side = random.below(2) == 0 ? -1 : 1;
  const double along = random.uniform(0.0, half * std::numbers::sqrt2);
  const double s = std::numbers::sqrt2 / 2.0;
  WorldPoint point;
  point.position = {side * along * s, random.uniform(-half, half), along * s - 0.5 * half};
  point.normal = {side * s, 0.0, -s};
  point.plane = side;
  return point;
}

WorldPoint cloud_point(CloudKind kind, double extent, Random& random) {
  const double half = 0.5 * extent;
  WorldPoint point;
  switch (kind) {
    case CloudKind::kBox:
      return box_point(random, half);
    case CloudKind::kTwoPlanes:
      return two_planes_point(random, half);
    case CloudKind::kSphere:
      point.normal = random.direction();
      point.position = half * point.normal;
      return point;
    case CloudKind::kVolume:
      point.position = {
          random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
      return point;
    case CloudKind::kPlane:
      point.position = {random.uniform(-half, half), random.uniform(-half, half), 0.0};
      point.normal = -Eigen::Vector3d::UnitZ();
      point.plane = 0;
      return point;
  }
  return point;
}

/// A camera at `center` that looks at `target`, its x axis level, turned about its axis by
/// `roll_rad`.
Rigid3 look_at(const Eigen::Vector3d& center, const Eigen::Vector3d& target, double roll_rad) {
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()) *
                                    Eigen::Quaterniond(cam_from_world));
  return {rotation.normalized(), -(rotation.normalized() * center)};
}

Eigen::Vector3d around_origin(double azimuth_rad, double height, double distance) {
  return {distance * std::sin(azimuth_rad), height, -distance * std::cos(azimuth_rad)};
}

Rigid3 random_pose(double d, Random& random) {
  const double azimuth = random.uniform(-50.0, 50.0) * kDeg;
  const double height = random.uniform(-0.5, 0.5) * d;
  const double distance = random.uniform(0.85, 1.2) * d;
  const Eigen::Vector3d target = 0.04 * d * random.normal3();
  return look_at(
      around_origin(azimuth, height, distance), target, random.uniform(-30.0, 30.0) * kDeg);
}

Rigid3 path_pose(const SyntheticSceneOptions& options, std::size_t i, Random& random) {
  const double count = static_cast<double>(options.views);
  const double d = options.distance;
  const double part = options.views < 2 ? 0.5 : static_cast<double>(i) / (count - 1.0);
  const double centered = part - 0.5;
  const double wave = 0.12 * d * std::sin(static_cast<double>(i) * 1.9);
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  switch (options.path) {
    case PathKind::kArc:
      return look_at(around_origin(centered * options.arc_deg * kDeg, wave, d), origin, 0.0);
    case PathKind::kOrbit:
      return look_at(
          around_origin(2.0 * std::numbers::pi * static_cast<double>(i) / count, wave, d),
          origin,
          0.0);
    case PathKind::kLine: {
      const Eigen::Vector3d center(0.6 * d * centered, 0.0, -d);
      return look_at(center, center + Eigen::Vector3d::UnitZ(), 0.0);
    }
    case PathKind::kForward: {
      const Eigen::Vector3d center(0.0, 0.0, -d * (1.3 - 0.6 * part));
      return look_at(center, center + Eigen::Vector3d::UnitZ(), 0.0);
    }
    case PathKind::kPureRotation: {
      const Eigen::Vector3d center(0.0, 0.0, -d);
      const double yaw = 16.0 * kDeg * centered;
      const double pitch = 3.0 * kDeg * std::sin(static_cast<double>(i) * 1.9);
      return look_at(center, center + Eigen::Vector3d(std::tan(yaw), std::tan(pitch), 1.0), 0.0);
    }
    case PathKind::kRandom:
      return random_pose(d, random);
  }
  return {};
}

bool is_in_image(const Camera& camera, const Eigen::Vector2d& pixel) {
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= camera.width_px - 1.0 &&
         pixel.y() <= camera.height_px - 1.0;
}

/// Where a point appears, or nothing when it is out of view or turned away.
std::optional<Eigen::Vector2d> see(const WorldPoint& point,
                                   const Camera& camera,
                                   const Rigid3& cam_from_world) {
  constexpr double kMinFacing = 0.1;  // cosine: surfaces seen more sideways are not detected
  const Eigen::Vector3d towards = (camera_center(cam_from_world) - point.position).normalized();
  if (!point.normal.isZero() && point.normal.dot(towards) < kMinFacing) {
    return std::nullopt;
  }
  const auto pixel = project(camera, cam_from_world * point.position);
  return pixel && is_in_image(camera, *pixel) ? pixel : std::nullopt;
}

/// A keypoint and the world point that caused it (kNoPoint: none).
struct Detection {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  std::size_t point = kNoPoint;
};

std::vector<Detection> detect(const SyntheticSceneOptions& options,
                              const std::vector<WorldPoint>& points,
                              const Camera& camera,
                              const Rigid3& cam_from_world,
                              Random& random) {
  std::vector<Detection> detections;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = see(points[i], camera, cam_from_world);
    if (!pixel || random.uniform() < options.dropout_ratio) {
      continue;
    }
    const double x_noise = options.noise_px * random.normal();
    const double y_noise = options.noise_px * random.normal();
    const Eigen::Vector2d seen = *pixel + Eigen::Vector2d(x_noise, y_noise);
    detections.push_back({seen.cast<float>(), i});
  }
  const auto clutter =
      static_cast<std::size_t>(options.clutter_ratio * static_cast<double>(detections.size()));
  for (std::size_t i = 0; i < clutter; ++i) {
    const double x = random.uniform(0.0, camera.width_px - 1.0);
    const double y = random.uniform(0.0, camera.height_px - 1.0);
    detections.push_back({Eigen::Vector2d(x, y).cast<float>(), kNoPoint});
  }
  random.shuffle(detections);
  return detections;
}

std::vector<Camera> make_cameras(const SyntheticSceneOptions& options) {
  std::vector<Camera> cameras;
  for (std::size_t group = 0; group < options.camera_groups; ++group) {
    Camera camera = options.camera;
    const double scale = 1.0 + 0.1 * static_cast<double>(group);
    camera.fx_px *= scale;
    camera.fy_px *= scale;
    cameras.push_back(camera);
  }
  return cameras;
}

/// Everything while it is being made.
struct Workshop {
  std::vector<WorldPoint> points;                  // of all components
  std::vector<std::vector<Detection>> detections;  // by view; `point` is an index into `points`
};

void add_component(const SyntheticSceneOptions& options,
                   std::size_t component,
                   Workshop& workshop,
                   SyntheticScene& out) {
  Random random(options.seed * 7919U + component);
  const Eigen::Vector3d shift(kComponentSpacing * static_cast<double>(component), 0.0, 0.0);
  std::vector<WorldPoint> points(options.points);
  for (WorldPoint& point : points) {
    point = cloud_point(options.cloud, options.extent, random);
    point.position += shift;
  }
  const std::size_t first_point = workshop.points.size();
  workshop.points.insert(workshop.points.end(), points.begin(), points.end());
  for (std::size_t i = 0; i < options.views; ++i) {
    View view;
    view.name = fmt::format("component{}/view{:03}.jpg", component, i);
    view.camera = id_of<CameraId>(i % options.camera_groups);
    const Rigid3 cam_from_local = path_pose(options, i, random);
    view.cam_from_world = cam_from_local * Rigid3{Eigen::Quaterniond::Identity(), -shift};
    const Camera& camera = out.truth.cameras[index(view.camera)];
    auto detections = detect(options, points, camera, *view.cam_from_world, random);
    for (Detection& detection : detections) {
      view.keypoints_px.push_back(detection.pixel);
      detection.point += detection.point == kNoPoint ? 0 : first_point;
    }
    view.landmarks.assign(view.keypoints_px.size(), kNoLandmark);
    workshop.detections.push_back(std::move(detections));
    out.truth.views.push_back(std::move(view));
    out.component_of_view.push_back(component);
  }
}

std::uint8_t color_of(double coordinate, double extent) {
  return static_cast<std::uint8_t>(std::clamp(127.5 + 200.0 * coordinate / extent, 0.0, 255.0));
}

void add_landmarks(const SyntheticSceneOptions& options, const Workshop& workshop, Scene& scene) {
  std::vector<std::vector<Observation>> tracks(workshop.points.size());
  for (std::size_t v = 0; v < workshop.detections.size(); ++v) {
    for (std::size_t k = 0; k < workshop.detections[v].size(); ++k) {
      if (workshop.detections[v][k].point != kNoPoint) {
        tracks[workshop.detections[v][k].point].push_back(
            {id_of<ViewId>(v), id_of<FeatureIndex>(k)});
      }
    }
  }
  for (std::size_t p = 0; p < tracks.size(); ++p) {
    if (tracks[p].size() < 2) {
      continue;
    }
    Landmark landmark;
    landmark.position_in_world = workshop.points[p].position;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double local = std::remainder(landmark.position_in_world[i], kComponentSpacing);
      landmark.color_rgb[static_cast<std::size_t>(i)] = color_of(local, options.extent);
    }
    for (const Observation& seen : tracks[p]) {
      scene.views[index(seen.view)].landmarks[index(seen.feature)] =
          id_of<LandmarkId>(scene.landmarks.size());
    }
    landmark.track = std::move(tracks[p]);
    scene.landmarks.push_back(std::move(landmark));
  }
}

Eigen::Matrix3d true_fundamental(const Scene& scene, const View& first, const View& second) {
  const Rigid3 second_from_first = *second.cam_from_world * first.cam_from_world->inverse();
  const Eigen::Vector3d t = second_from_first.translation;
  Eigen::Matrix3d cross;
  cross << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  const Eigen::Matrix3d essential = cross * second_from_first.rotation.toRotationMatrix();
  const Eigen::Matrix3d k1 = scene.cameras[index(first.camera)].calibration_matrix();
  const Eigen::Matrix3d k2 = scene.cameras[index(second.camera)].calibration_matrix();
  const Eigen::Matrix3d f = k2.inverse().transpose() * essential * k1.inverse();
  return f.norm() > 0.0 ? Eigen::Matrix3d(f / f.norm()) : f;
}

double distance_to_epipolar_line(const Eigen::Matrix3d& fundamental,
                                 const Eigen::Vector2f& first,
                                 const Eigen::Vector2f& second) {
  const Eigen::Vector3d line = fundamental * first.cast<double>().homogeneous();
  const double length = line.head<2>().norm();
  return length > 0.0 ? std::abs(second.cast<double>().homogeneous().dot(line)) / length : 0.0;
}

class PairMaker {
 public:
  PairMaker(const SyntheticSceneOptions& options, const Workshop& workshop, const Scene& scene)
      : options_(options), workshop_(workshop), scene_(scene), random_(options.seed + 104729U) {
    feature_of_point_.resize(workshop.detections.size());
    for (std::size_t v = 0; v < workshop.detections.size(); ++v) {
      feature_of_point_[v].assign(workshop.points.size(), kNoPoint);
      for (std::size_t k = 0; k < workshop.detections[v].size(); ++k) {
        if (workshop.detections[v][k].point != kNoPoint) {
          feature_of_point_[v][workshop.detections[v][k].point] = k;
        }
      }
    }
  }

  std::optional<SyntheticPair> make(std::size_t first, std::size_t second) {
    SyntheticPair out;
    out.pair = {id_of<ViewId>(first), id_of<ViewId>(second)};
    TwoViewGeometry& geometry = out.geometry;
    geometry.fundamental = true_fundamental(scene_, scene_.views[first], scene_.views[second]);
    std::map<int, std::size_t> on_plane;
    for (std::size_t p = 0; p < workshop_.points.size(); ++p) {
      if (feature_of_point_[first][p] != kNoPoint && feature_of_point_[second][p] != kNoPoint) {
        geometry.inliers.push_back({id_of<FeatureIndex>(feature_of_point_[first][p]),
                                    id_of<FeatureIndex>(feature_of_point_[second][p])});
        ++on_plane[workshop_.points[p].plane];
      }
    }
    if (geometry.inliers.size() < options_.min_pair_matches) {
      return std::nullopt;
    }
    on_plane.erase(-1);
    classify(first, second, on_plane, geometry);
    add_outliers(first, second, geometry);
    std::sort(geometry.inliers.begin(), geometry.inliers.end());
    geometry.candidates = geometry.inliers.size() + geometry.inliers.size() / 3;
    return out;
  }

 private:
  void classify(std::size_t first,
                std::size_t second,
                const std::map<int, std::size_t>& on_plane,
                TwoViewGeometry& geometry) const {
    const Eigen::Vector3d baseline = camera_center(*scene_.views[first].cam_from_world) -
                                     camera_center(*scene_.views[second].cam_from_world);
    for (const auto& [plane, count] : on_plane) {
      geometry.homography_inliers = std::max(geometry.homography_inliers, count);
    }
    geometry.kind = TwoViewKind::kGeneral;
    if (baseline.norm() < 1e-9 * options_.distance) {
      geometry.kind = TwoViewKind::kPureRotation;
      geometry.homography_inliers = geometry.inliers.size();
    } else if (geometry.homography_inliers == geometry.inliers.size()) {
      geometry.kind = TwoViewKind::kPlanar;
    }
  }

  /// Wrong matches use keypoints that have no right match in this pair, each at most once, as a
  /// mutual test leaves them.
  void add_outliers(std::size_t first, std::size_t second, TwoViewGeometry& geometry) {
    const double right = static_cast<double>(geometry.inliers.size());
    const auto wanted = static_cast<std::size_t>(
        std::lround(right * options_.outlier_ratio / (1.0 - options_.outlier_ratio)));
    std::vector<FeatureMatch> right_matches = geometry.inliers;
    std::vector<std::size_t> free_first = free_features(first, geometry.inliers, true);
    std::vector<std::size_t> free_second = free_features(second, geometry.inliers, false);
    random_.shuffle(free_first);
    random_.shuffle(free_second);
    for (std::size_t i = 0; i < wanted; ++i) {
      if (free_first.empty() || free_second.empty()) {
        swap_right_matches(geometry, wanted - i);
        return;
      }
      const std::size_t a = free_first.back();
      free_first.pop_back();
      const std::size_t choice = choose_partner(first, a, second, free_second, geometry);
      std::swap(free_second[choice], free_second.back());
      geometry.inliers.push_back({id_of<FeatureIndex>(a), id_of<FeatureIndex>(free_second.back())});
      free_second.pop_back();
    }
  }

  /// With no keypoint left over, right matches exchange their partners.
  void swap_right_matches(TwoViewGeometry& geometry, std::size_t count) {
    const std::size_t pairs = std::min(count, geometry.inliers.size()) / 2;
    for (std::size_t i = 0; i < pairs; ++i) {
      std::swap(geometry.inliers[2 * i].second, geometry.inliers[2 * i + 1].second);
    }
  }

  [[nodiscard]] std::vector<std::size_t> free_features(std::size_t view,
                                                       const std::vector<FeatureMatch>& matches,
                                                       bool of_first) const {
    std::vector<char> used(workshop_.detections[view].size(), 0);
    for (const FeatureMatch& match : matches) {
      used[index(of_first ? match.first : match.second)] = 1;
    }
    std::vector<std::size_t> unused;
    for (std::size_t k = 0; k < used.size(); ++k) {
      if (used[k] == 0) {
        unused.push_back(k);
      }
    }
    return unused;
  }

  std::size_t choose_partner(std::size_t first,
                             std::size_t feature,
                             std::size_t second,
                             const std::vector<std::size_t>& candidates,
                             const TwoViewGeometry& geometry) {
    if (options_.outlier_kind == OutlierKind::kAnywhere) {
      return random_.below(candidates.size());
    }
    constexpr int kTries = 32;
    std::size_t best = 0;
    double best_distance = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kTries; ++i) {
      const std::size_t choice = random_.below(candidates.size());
      const double distance =
          distance_to_epipolar_line(geometry.fundamental,
                                    scene_.views[first].keypoints_px[feature],
                                    scene_.views[second].keypoints_px[candidates[choice]]);
      if (distance < best_distance) {
        best_distance = distance;
        best = choice;
      }
    }
    return best;
  }

  const SyntheticSceneOptions& options_;
  const Workshop& workshop_;
  const Scene& scene_;
  Random random_;
  std::vector<std::vector<std::size_t>> feature_of_point_;  // by view and point
};

}  // namespace

SyntheticScene make_synthetic_scene(const SyntheticSceneOptions& options) {
  SyntheticScene out;
  out.truth.cameras = make_cameras(options);
  Workshop workshop;
  for (std::size_t component = 0; component < options.components; ++component) {
    add_component(options, component, workshop, out);
  }
  add_landmarks(options, workshop, out.truth);
  PairMaker pairs(options, workshop, out.truth);
  for (std::size_t first = 0; first < out.truth.views.size(); ++first) {
    for (std::size_t second = first + 1; second < out.truth.views.size(); ++second) {
      if (auto pair = pairs.make(first, second)) {
        out.pairs.push_back(std::move(*pair));
      }
    }
  }
  return out;
}

Scene without_model(const Scene& scene) {
  Scene bare = scene;
  bare.landmarks.clear();
  for (View& view : bare.views) {
    view.cam_from_world.reset();
    view.landmarks.assign(view.keypoints_px.size(), kNoLandmark);
  }
  return bare;
}

Scene perturbed(const Scene& scene, const Perturbation& perturbation) {
  Random random(perturbation.seed);
  Scene moved = scene;
  for (View& view : moved.views) {
    if (!view.cam_from_world) {
      continue;
    }
    const Eigen::Vector3d turn = perturbation.rotation_rad * random.normal3();
    const Eigen::Vector3d center =
        camera_center(*view.cam_from_world) + perturbation.translation * random.normal3();
    Eigen::Quaterniond rotation = view.cam_from_world->rotation;
    if (turn.norm() > 0.0) {
      rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * rotation;
      rotation.normalize();
    }
    if (perturbation.rotation_rad > 0.0 || perturbation.translation > 0.0) {
      view.cam_from_world = Rigid3{rotation, -(rotation * center)};
    }
  }
  for (Landmark& landmark : moved.landmarks) {
    landmark.position_in_world += perturbation.point * random.normal3();
  }
  return moved;
}

}  // namespace trigmesh::test_support
