#pragma once

#include <span>
#include <vector>

#include "firmware/base/executor.hpp"
#include "sfm/mapping/map.hpp"
#include "sfm/mapping/mapper.hpp"

namespace trigmesh {

/// Makes, extends, corrects and drops the landmarks of a map while its poses stand still.
class Structure {
 public:
  /// All outlive the object. `executor` may use several threads; results do not depend on it.
  Structure(const TrackTable& tracks, const MapperOptions& options, Executor& executor)
      : tracks_(&tracks), options_(&options), executor_(&executor) {}

  /// Landmarks for those of the given tracks that have none, from all registered views that see
  /// them. Returns how many.
  std::size_t triangulate(Map& map, std::span<const TrackId> tracks) const;

  /// The same for every track seen by a registered view.
  std::size_t triangulate_all(Map& map) const;

  /// Adds to landmarks the keypoints of their tracks in registered views that now agree. Returns
  /// how many.
  std::size_t complete(Map& map) const;

  /// Best position of every landmark for the poses as they are: after adjustments that moved poses
  /// but not all landmarks.
  void reposition(Map& map) const;

  struct FilterReport {
    std::size_t removed_observations = 0;
    std::size_t removed_landmarks = 0;
  };

  /// Drops observations above `max_error_px` or behind their camera, and landmarks whose rays are
  /// too nearly parallel.
  FilterReport filter(Map& map, double max_error_px) const;

 private:
  const TrackTable* tracks_;
  const MapperOptions* options_;
  Executor* executor_;
};

/// Reprojection error of one observation in pixels; infinite where the landmark does not project.
[[nodiscard]] double reprojection_error_px(const Map& map,
                                           LandmarkId landmark,
                                           const Observation& observation);

/// Largest angle between two rays of a landmark, radians.
[[nodiscard]] double largest_triangulation_angle(const Map& map, LandmarkId landmark);

}  // namespace trigmesh
