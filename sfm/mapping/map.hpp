#pragma once

#include <span>
#include <vector>

#include "sfm/mapping/track_table.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// One connected model under construction: a Scene whose landmarks stem from tracks, kept
/// consistent by the functions below (poses, both sides of every observation, and for each
/// unregistered view the count of landmarks it could see). Removed landmarks leave a gap with an
/// empty track until `compact`.
class Map {
 public:
  explicit Map(const TrackTable& tracks) : tracks_(&tracks) {}  ///< `tracks` outlives the map

  /// Adds a view without pose; views come in the order of their ViewId, in every map of the mapper.
  void add_view(View view);

  /// Adds the next camera group.
  void add_camera(const Camera& camera) { scene_.cameras.push_back(camera); }

  [[nodiscard]] const Scene& scene() const { return scene_; }

  /// For bundle adjustment, which changes poses, positions and intrinsics but no connection.
  [[nodiscard]] Scene& scene_for_adjustment() { return scene_; }

  [[nodiscard]] bool is_registered(ViewId view) const {
    return view_at(view).cam_from_world.has_value();
  }

  [[nodiscard]] const Rigid3& pose(ViewId view) const { return *view_at(view).cam_from_world; }

  [[nodiscard]] const Camera& camera_of(ViewId view) const {
    return scene_.cameras[index(view_at(view).camera)];
  }

  [[nodiscard]] Eigen::Vector2d pixel(const Observation& observation) const {
    return view_at(observation.view).keypoints_px[index(observation.feature)].cast<double>();
  }

  /// Registered views in order of registration.
  [[nodiscard]] std::span<const ViewId> registered() const { return registered_; }

  void register_view(ViewId view, const Rigid3& cam_from_world);
  /// Takes the pose away and with it all its observations; landmarks left with fewer than two views
  /// go too.
  void unregister_view(ViewId view);

  /// The landmark of a track, or kNoLandmark.
  [[nodiscard]] LandmarkId landmark_of(TrackId track) const {
    return index(track) < landmark_of_track_.size() ? landmark_of_track_[index(track)]
                                                    : kNoLandmark;
  }

  [[nodiscard]] TrackId track_of(LandmarkId landmark) const {
    return track_of_landmark_[index(landmark)];
  }

  [[nodiscard]] const Landmark& landmark(LandmarkId id) const {
    return scene_.landmarks[index(id)];
  }

  [[nodiscard]] bool exists(LandmarkId id) const { return !landmark(id).track.empty(); }

  void add_landmark(TrackId track,
                    const Eigen::Vector3d& position_in_world,
                    std::span<const Observation> observations);
  void add_observation(LandmarkId landmark, Observation observation);
  /// The landmark goes with its second last observation.
  void remove_observation(LandmarkId landmark, Observation observation);
  void remove_landmark(LandmarkId landmark);

  void set_position(LandmarkId id, const Eigen::Vector3d& position_in_world) {
    scene_.landmarks[index(id)].position_in_world = position_in_world;
  }

  void set_error(LandmarkId id, double error_px) {
    scene_.landmarks[index(id)].error_px = error_px;
  }

  /// Must be called after the track table grew: landmarks of absorbed tracks go (their keypoints
  /// come back through the surviving track) and visible counts are made anew.
  void tracks_changed(std::span<const TrackId> absorbed);

  /// For a view: how many keypoints belong to tracks that have a landmark.
  [[nodiscard]] std::size_t visible_count(ViewId view) const { return visible_count_[index(view)]; }

  /// Keypoints of a view whose track has a landmark: the 2D-3D matches for its pose. Sorted by
  /// feature.
  struct Candidate {
    FeatureIndex feature{};
    LandmarkId landmark{};
  };

  [[nodiscard]] std::vector<Candidate> candidates(ViewId view) const;

  /// Ids of the landmarks that exist, ascending.
  [[nodiscard]] std::vector<LandmarkId> landmarks() const;

  [[nodiscard]] std::size_t landmark_count() const { return landmark_count_; }

  /// Drops the gaps and gives the finished scene.
  [[nodiscard]] Scene compact() const;

 private:
  [[nodiscard]] const View& view_at(ViewId id) const { return scene_.views[index(id)]; }

  void count_visible(TrackId track, int change);
  void detach(LandmarkId landmark);

  const TrackTable* tracks_;
  Scene scene_;
  std::vector<ViewId> registered_;
  std::vector<LandmarkId> landmark_of_track_;
  std::vector<TrackId> track_of_landmark_;
  std::vector<std::size_t> visible_count_;
  std::size_t landmark_count_ = 0;
};

}  // namespace trigmesh
