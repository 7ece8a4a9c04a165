#pragma once

#include <optional>
#include <vector>

#include "sfm/geometry/similarity.hpp"
#include "sfm/mapping/image_store.hpp"
#include "sfm/mapping/map.hpp"
#include "sfm/mapping/mapper.hpp"
#include "sfm/mapping/model_adjustment.hpp"
#include "sfm/mapping/structure.hpp"

namespace trigmesh {

/// Grows one map from its starting pair to its last adjustment.
class MapBuilder {
 public:
  /// All outlive the builder; the builder marks images in `store` as registered and notes failed
  /// tries there.
  MapBuilder(ImageStore& store, const MapperOptions& options, Executor& executor);

  /// Follows additions to the store: cameras, images, and the tracks that others absorbed.
  void follow_store(std::span<const TrackId> absorbed);

  /// Begins the map with the best pair of images that no map has. False when no pair carries one.
  [[nodiscard]] bool seed();

  /// Registers the next best image. Nothing when none can be now.
  [[nodiscard]] std::optional<StepReport> register_next();

  /// Adjusts, corrects and completes the map so that images refused before may fit now. False when
  /// nothing has changed since the last time.
  [[nodiscard]] bool refine();

  /// Landmarks and observations that tracks allow now but did not when their views were registered.
  void extend();

  /// Last adjustments with all landmarks; drops views that parallax does not support (noted in the
  /// store).
  void finish();

  /// Takes in another map whose place in this one is known.
  void join(const Map& other, const Sim3& map_from_other);

  [[nodiscard]] const Map& map() const { return map_; }

 private:
  [[nodiscard]] std::vector<ViewId> ranked_views() const;
  [[nodiscard]] bool try_register(ViewId view);
  void settle(ViewId view);
  void drop_unsupported_views();
  void drop_model_without_parallax();
  void drop_view(ViewId view, std::size_t supported_landmarks);
  [[nodiscard]] bool worth_trying(ViewId view) const;
  [[nodiscard]] ModelAdjustment adjustment() const;

  ImageStore* store_;
  const MapperOptions* options_;
  Executor* executor_;
  Structure structure_;
  Map map_;
  std::size_t views_at_last_global_ = 0;
  std::size_t views_at_last_refine_ = 0;
  std::vector<std::size_t> matches_at_failure_;  ///< per view: map matches when its pose could not
                                                 ///< be found; 0 = not tried
};

}  // namespace trigmesh
