#include "sfm/mapping/mapper.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/check.hpp"
#include "sfm/mapping/focal_vote.hpp"
#include "sfm/mapping/image_store.hpp"
#include "sfm/mapping/loop_check.hpp"
#include "sfm/mapping/map_builder.hpp"
#include "sfm/mapping/map_joining.hpp"
#include "sfm/mapping/refusal.hpp"
#include "sfm/mapping/structure.hpp"

namespace trigmesh {

namespace {

// Two maps are one when this many tracks have a landmark in both and agree this well (of the spread
// of those landmarks).
constexpr std::size_t kMinCommonLandmarks = 15;
constexpr double kMaxJoinErrorRatio = 0.03;
// A model of fewer views is not worth showing.
constexpr std::size_t kMinViewsOfModel = 2;
// A keypoint found at a coarse scale is placed that much less exactly.
constexpr float kReferenceScalePx = 2.0F;
constexpr float kFinestScalePx = 0.5F;

template <typename T>
bool between(T value, T low, T high) {
  return value >= low && value <= high;
}

}  // namespace

Result<> MapperOptions::validate() const {
  const auto refuse = [](const char* name, double value, const char* rule) {
    return fail(
        ErrorCode::kInvalidArgument, "mapper option {} is {}: it must be in {}", name, value, rule);
  };
  if (!between(min_pose_inliers, 6, 1000)) {
    return refuse("min_pose_inliers", min_pose_inliers, "[6, 1000]");
  }
  if (!between(min_seed_landmarks, 10, 1000)) {
    return refuse("min_seed_landmarks", min_seed_landmarks, "[10, 1000]");
  }
  if (!(min_triangulation_angle_deg > 0.0 && min_triangulation_angle_deg <= 30.0)) {
    return refuse("min_triangulation_angle_deg", min_triangulation_angle_deg, "(0, 30]");
  }
  if (!(max_reprojection_px > 0.0 && max_reprojection_px <= 100.0)) {
    return refuse("max_reprojection_px", max_reprojection_px, "(0, 100]");
  }
  if (!(final_reprojection_px > 0.0 && final_reprojection_px <= 100.0)) {
    return refuse("final_reprojection_px", final_reprojection_px, "(0, 100]");
  }
  if (!(max_pose_error_px > 0.0 && max_pose_error_px <= 100.0)) {
    return refuse("max_pose_error_px", max_pose_error_px, "(0, 100]");
  }
  if (!(loss_scale_px > 0.0 && loss_scale_px <= 100.0)) {
    return refuse("loss_scale_px", loss_scale_px, "(0, 100]");
  }
  if (!between(min_supported_landmarks, 6, 1000)) {
    return refuse("min_supported_landmarks", min_supported_landmarks, "[6, 1000]");
  }
  if (!(min_view_parallax_deg > 0.0 && min_view_parallax_deg <= 30.0)) {
    return refuse("min_view_parallax_deg", min_view_parallax_deg, "(0, 30]");
  }
  if (!(min_model_parallax_deg > 0.0 && min_model_parallax_deg <= 30.0)) {
    return refuse("min_model_parallax_deg", min_model_parallax_deg, "(0, 30]");
  }
  if (!(global_growth_ratio > 1.0 && global_growth_ratio <= 10.0)) {
    return refuse("global_growth_ratio", global_growth_ratio, "(1, 10]");
  }
  if (!between(landmarks_per_view, 20, 100000)) {
    return refuse("landmarks_per_view", landmarks_per_view, "[20, 100000]");
  }
  return {};
}

struct Mapper::State {
  State(const MapperOptions& mapper_options, Executor& mapper_executor)
      : options(mapper_options), executor(&mapper_executor) {}

  void follow_additions();
  void vote_focal_lengths_once();
  StepReport seed_map();
  void join_maps();
  [[nodiscard]] std::vector<const MapBuilder*> ranked_maps() const;

  MapperOptions options;
  Executor* executor;
  ImageStore store;
  std::vector<std::unique_ptr<MapBuilder>> maps;
  std::vector<TrackId> absorbed;  ///< tracks given up since the maps last followed
  bool additions = false;         ///< anything added since the maps last followed
  bool seeding_failed = false;    ///< no pair carries a map; until something is added
};

Result<Mapper> Mapper::create(const MapperOptions& options, Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  return Mapper(std::make_unique<State>(options, executor));
}

Mapper::Mapper(std::unique_ptr<State> state) : state_(std::move(state)) {}

Mapper::Mapper(Mapper&&) noexcept = default;
Mapper& Mapper::operator=(Mapper&&) noexcept = default;
Mapper::~Mapper() = default;

CameraId Mapper::add_camera(const Camera& camera, IntrinsicsKnowledge knowledge) {
  state_->store.cameras.push_back({camera, knowledge});
  state_->additions = true;
  return id_of<CameraId>(state_->store.cameras.size() - 1);
}

ViewId Mapper::add_image(MapperImage image) {
  ImageStore& store = state_->store;
  TM_CHECK(index(image.camera) < store.cameras.size());
  ImageRecord record{std::move(image.name), image.camera, {}, {}, {}, false};
  std::vector<float> sigmas;
  record.keypoints_px.reserve(image.keypoints.size());
  sigmas.reserve(image.keypoints.size());
  for (const Keypoint& keypoint : image.keypoints) {
    record.keypoints_px.emplace_back(keypoint.x_px, keypoint.y_px);
    sigmas.push_back(std::max(keypoint.scale_px, kFinestScalePx) / kReferenceScalePx);
  }
  store.tracks.add_view(record.keypoints_px.size());
  store.images.push_back(std::move(record));
  store.sigmas_px.push_back(std::move(sigmas));
  state_->additions = true;
  return id_of<ViewId>(store.images.size() - 1);
}

void Mapper::add_pair(ImagePair pair, const TwoViewGeometry& geometry) {
  ImageStore& store = state_->store;
  TM_CHECK(pair.first < pair.second && index(pair.second) < store.images.size());
  store.images[index(pair.first)].pairs.push_back(store.pairs.size());
  store.images[index(pair.second)].pairs.push_back(store.pairs.size());
  store.pairs.push_back({pair, geometry});
  state_->additions = true;
  if (!shows_one_scene(geometry.kind)) {
    return;
  }
  const std::vector<TrackId> gone = store.tracks.add_matches(pair, geometry.inliers);
  state_->absorbed.insert(state_->absorbed.end(), gone.begin(), gone.end());
}

void Mapper::State::follow_additions() {
  if (!additions) {
    return;
  }
  for (const auto& map : maps) {
    map->follow_store(absorbed);
  }
  absorbed.clear();
  additions = false;
  seeding_failed = false;
}

void Mapper::State::vote_focal_lengths_once() {
  std::vector<Camera> cameras;
  std::vector<bool> unknown;
  for (const CameraRecord& record : store.cameras) {
    cameras.push_back(record.camera);
    unknown.push_back(record.knowledge == IntrinsicsKnowledge::kUnknown);
  }
  if (std::none_of(unknown.begin(), unknown.end(), [](bool u) { return u; })) {
    return;
  }
  std::vector<FocalEvidence> evidence;
  for (const PairRecord& record : store.pairs) {
    if (record.geometry.kind == TwoViewKind::kGeneral) {
      evidence.push_back({store.images[index(record.pair.first)].camera,
                          store.images[index(record.pair.second)].camera,
                          record.geometry.fundamental,
                          static_cast<double>(record.geometry.inliers.size())});
    }
  }
  const std::vector<double> focal_px = vote_focal_lengths(cameras, unknown, evidence);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (unknown[i]) {
      store.cameras[i].camera.fx_px = store.cameras[i].camera.fy_px = focal_px[i];
    }
  }
}

StepReport Mapper::State::seed_map() {
  if (seeding_failed) {
    return {};
  }
  if (maps.empty()) {
    vote_focal_lengths_once();
  }
  auto map = std::make_unique<MapBuilder>(store, options, *executor);
  if (!map->seed()) {
    seeding_failed = true;
    return {};
  }
  maps.push_back(std::move(map));
  const Map& seeded = maps.back()->map();
  return {StepKind::kSeeded,
          seeded.registered().back(),
          seeded.landmark_count(),
          seeded.landmark_count()};
}

StepReport Mapper::step() {
  state_->follow_additions();
  for (const auto& map : state_->maps) {
    if (const auto report = map->register_next()) {
      return *report;
    }
  }
  for (const auto& map : state_->maps) {
    if (map->refine()) {
      if (const auto report = map->register_next()) {
        return *report;
      }
    }
  }
  return state_->seed_map();
}

std::size_t Mapper::track() {
  state_->follow_additions();
  std::size_t registered = 0;
  for (const auto& map : state_->maps) {
    while (map->register_next()) {
      ++registered;
    }
  }
  return registered;
}

bool Mapper::is_registered(ViewId view) const {
  return state_->store.images[index(view)].registered;
}

std::optional<double> Mapper::disagreement_deg(ImagePair pair,
                                               std::span<const FeatureMatch> matches) const {
  for (const auto& map : state_->maps) {
    if (map->map().is_registered(pair.first) && map->map().is_registered(pair.second)) {
      return trigmesh::disagreement_deg(map->map(), pair, matches);
    }
  }
  return std::nullopt;
}

void Mapper::State::join_maps() {
  for (std::size_t i = 0; i < maps.size(); ++i) {
    for (std::size_t j = i + 1; j < maps.size();) {
      const auto overlap = find_overlap(
          maps[i]->map(), maps[j]->map(), kMinCommonLandmarks, kMaxJoinErrorRatio, options.seed);
      if (!overlap) {
        ++j;
        continue;
      }
      maps[i]->join(maps[j]->map(), *overlap);
      maps.erase(maps.begin() + static_cast<std::ptrdiff_t>(j));
      j = i + 1;
    }
  }
}

void Mapper::finish() {
  state_->follow_additions();
  // Pairs that came after the maps had grown may have made one track of what both maps see.
  for (const auto& map : state_->maps) {
    map->extend();
  }
  state_->join_maps();
  for (const auto& map : state_->maps) {
    map->finish();
  }
  std::erase_if(state_->maps,
                [](const auto& map) { return map->map().registered().size() < kMinViewsOfModel; });
}

std::size_t Mapper::registered_count() const {
  return static_cast<std::size_t>(std::count_if(
      state_->store.images.begin(), state_->store.images.end(), [](const ImageRecord& image) {
        return image.registered;
      }));
}

std::size_t Mapper::image_count() const {
  return state_->store.images.size();
}

std::vector<const MapBuilder*> Mapper::State::ranked_maps() const {
  std::vector<const MapBuilder*> ranked;
  for (const auto& map : maps) {
    ranked.push_back(map.get());
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const MapBuilder* a, const MapBuilder* b) {
    return a->map().registered().size() > b->map().registered().size();
  });
  return ranked;
}

std::vector<Scene> Mapper::components() const {
  std::vector<Scene> scenes;
  for (const MapBuilder* map : state_->ranked_maps()) {
    scenes.push_back(map->map().compact());
  }
  return scenes;
}

std::vector<ImageOutcome> Mapper::outcomes() const {
  std::vector<ImageOutcome> outcomes;
  for (std::size_t i = 0; i < state_->store.images.size(); ++i) {
    outcomes.push_back(explain_refusal(state_->store, id_of<ViewId>(i), state_->options));
  }
  const auto maps = state_->ranked_maps();
  for (std::size_t component = 0; component < maps.size(); ++component) {
    for (const ViewId view : maps[component]->map().registered()) {
      describe_registration(
          outcomes[index(view)], maps[component]->map(), view, static_cast<int>(component));
    }
  }
  return outcomes;
}

}  // namespace trigmesh
