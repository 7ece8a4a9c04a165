#include "sfm/mapping/track_table.hpp"

#include <algorithm>
#include <utility>

namespace trigmesh {

namespace {

bool share_a_view(std::span<const Observation> a, std::span<const Observation> b) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (a[i].view == b[j].view) {
      return true;
    }
    a[i].view < b[j].view ? ++i : ++j;
  }
  return false;
}

}  // namespace

void TrackTable::add_view(std::size_t feature_count) {
  tracks_of_view_.emplace_back(feature_count, kNoTrack);
}

std::vector<TrackId> TrackTable::add_matches(ImagePair pair,
                                             std::span<const FeatureMatch> matches) {
  std::vector<TrackId> absorbed;
  for (const FeatureMatch& match : matches) {
    const TrackId first = track_for({pair.first, match.first});
    const TrackId second = track_for({pair.second, match.second});
    if (first == second) {
      continue;
    }
    if (share_a_view(observations(first), observations(second))) {
      ++conflict_count_;
      continue;
    }
    absorbed.push_back(join(first, second));
  }
  return absorbed;
}

TrackId TrackTable::track_for(Observation observation) {
  TrackId& track = tracks_of_view_[index(observation.view)][index(observation.feature)];
  if (track == kNoTrack) {
    track = id_of<TrackId>(tracks_.size());
    tracks_.push_back({observation});
  }
  return track;
}

TrackId TrackTable::join(TrackId a, TrackId b) {
  if (tracks_[index(a)].size() < tracks_[index(b)].size()) {
    std::swap(a, b);
  }
  std::vector<Observation>& kept = tracks_[index(a)];
  std::vector<Observation>& given_up = tracks_[index(b)];
  const auto middle = static_cast<std::ptrdiff_t>(kept.size());
  for (const Observation& observation : given_up) {
    tracks_of_view_[index(observation.view)][index(observation.feature)] = a;
    kept.push_back(observation);
  }
  std::inplace_merge(kept.begin(), kept.begin() + middle, kept.end());
  given_up.clear();
  given_up.shrink_to_fit();
  return b;
}

}  // namespace trigmesh
