#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sfm/matching/matches.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// Position in TrackTable: all keypoints that matches say are one and the same scene point.
enum class TrackId : std::uint32_t {};

inline constexpr TrackId kNoTrack{std::numeric_limits<std::uint32_t>::max()};

/// Groups matched keypoints into tracks while image pairs arrive one after the other. A track never
/// holds two keypoints of one image: a match that would join such tracks is refused and counted, so
/// one wrong match cannot chain two scene points together through an image that sees both. Earlier
/// pairs win: add the strongest first.
class TrackTable {
 public:
  /// Makes room for the keypoints of the next view; views are added in the order of their ViewId.
  void add_view(std::size_t feature_count);
  /// Joins the tracks of each match. Returns the tracks that were given up because another one
  /// absorbed them.
  std::vector<TrackId> add_matches(ImagePair pair, std::span<const FeatureMatch> matches);

  [[nodiscard]] TrackId track_of(Observation observation) const {
    return tracks_of_view_[index(observation.view)][index(observation.feature)];
  }

  /// Observations sorted by view; empty for a track that was absorbed.
  [[nodiscard]] std::span<const Observation> observations(TrackId track) const {
    return tracks_[index(track)];
  }

  [[nodiscard]] std::span<const TrackId> tracks_of(ViewId view) const {
    return tracks_of_view_[index(view)];
  }

  [[nodiscard]] std::size_t size() const { return tracks_.size(); }

  /// Matches refused because they would have put two keypoints of one image into a track.
  [[nodiscard]] std::size_t conflict_count() const { return conflict_count_; }

 private:
  TrackId track_for(Observation observation);
  TrackId join(TrackId a, TrackId b);

  std::vector<std::vector<Observation>> tracks_;
  std::vector<std::vector<TrackId>> tracks_of_view_;
  std::size_t conflict_count_ = 0;
};

}  // namespace trigmesh
