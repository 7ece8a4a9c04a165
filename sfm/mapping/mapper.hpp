#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/features/features.hpp"
#include "sfm/matching/matches.hpp"
#include "sfm/scene/outcome.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// What is known about the intrinsics of a camera group before mapping.
enum class IntrinsicsKnowledge {
  kGiven,    ///< calibrated: kept fixed
  kPrior,    ///< focal length from EXIF: pulled towards it, refined
  kUnknown,  ///< solved: focal length guessed from the epipolar geometry of all pairs, then refined
};

/// Thresholds of the mapping engine. Pixels refer to images as they were given.
struct MapperOptions {
  /// Fewest 2D-3D inliers that make a pose, [6, 1000].
  int min_pose_inliers = 20;
  /// Fewest landmarks of the starting pair, [10, 1000].
  int min_seed_landmarks = 50;
  /// Smallest angle between two rays of a landmark, degrees, (0, 30]. Below about 1 degree depth is
  /// noise.
  double min_triangulation_angle_deg = 1.5;
  /// Reprojection error above which an observation is refused while the model grows, pixels, (0,
  /// 100].
  double max_reprojection_px = 4.0;
  /// The same in the last adjustments, when poses and intrinsics are settled, pixels, (0, 100].
  double final_reprojection_px = 2.0;
  /// Error that pose estimation accepts, pixels, (0, 100]; twice as much while intrinsics are not
  /// known.
  double max_pose_error_px = 4.0;
  /// Scale of the robust loss in bundle adjustment, in pixels of a keypoint found at scale 2, (0,
  /// 100].
  double loss_scale_px = 0.5;
  /// A view needs this many landmarks seen under `min_view_parallax_deg` by its map to count as
  /// supported, [6, 1000].
  int min_supported_landmarks = 15;
  double min_view_parallax_deg = 2.0;
  /// A model of which half the landmarks are seen under less than this is none, degrees, (0, 30]:
  /// when a camera turns on the spot, a rolling shutter and an unknown lens feign such depth.
  double min_model_parallax_deg = 3.0;
  /// All adjustment of the whole model: after growth by this factor, (1, 10].
  double global_growth_ratio = 1.35;
  /// Landmarks kept per view in intermediate adjustments, [20, 100000]: they are chosen by track
  /// length. The final adjustment takes all.
  int landmarks_per_view = 150;
  /// Seed of all random sampling.
  std::uint64_t seed = 0;

  [[nodiscard]] Result<> validate() const;
};

/// An image as the mapper sees it. Keypoints in pixels, first pixel centre = (0, 0).
struct MapperImage {
  std::string name;
  CameraId camera{};
  std::vector<Keypoint> keypoints;
};

/// What one step did.
enum class StepKind {
  kNothing,     ///< nothing more can be done with the images and pairs added so far
  kSeeded,      ///< a starting pair was found: two views registered
  kRegistered,  ///< one more view
};

struct StepReport {
  StepKind kind = StepKind::kNothing;
  ViewId view{};
  std::size_t inliers = 0;
  std::size_t landmarks = 0;
};

/// The engine of incremental structure from motion (Allouache et al.: features -> F -> E = K'FK ->
/// four poses -> cheirality
/// -> triangulation -> next image -> bundle adjustment), for photographs and for live frames alike:
///
///   auto mapper = Mapper::create(options, executor);       // executor outlives the mapper
///   const CameraId camera = mapper->add_camera(camera, IntrinsicsKnowledge::kGiven);
///   for each image as it comes:
///     const ViewId view = mapper->add_image({name, camera, keypoints});
///     for each earlier image that it was matched with: mapper->add_pair({earlier, view},
///     geometry); while (mapper->step().kind != StepKind::kNothing) {}   // or later, after all
///     images
///   mapper->finish();                                       // last adjustment; more images may
///   follow after it mapper->components(), mapper->outcomes()
///
/// Images that share no view with a model begin another component; components join when they come
/// to see the same landmarks. Same calls and options give the same bits. Single thread (the
/// executor may use more).
class Mapper {
 public:
  [[nodiscard]] static Result<Mapper> create(const MapperOptions& options, Executor& executor);

  Mapper(Mapper&&) noexcept;
  Mapper& operator=(Mapper&&) noexcept;
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;
  ~Mapper();

  CameraId add_camera(const Camera& camera, IntrinsicsKnowledge knowledge);
  ViewId add_image(MapperImage image);
  /// A verified pair, `pair.first < pair.second`, both added. Strong pairs first make better
  /// tracks.
  void add_pair(ImagePair pair, const TwoViewGeometry& geometry);

  /// Registers the next best view, or starts a model, or reports that neither can be done now.
  StepReport step();

  /// Registers what fits the models as they are: no refinement of a whole model, no new one. For
  /// frames that come one after the other; cheap. Returns how many views were registered.
  std::size_t track();

  [[nodiscard]] bool is_registered(ViewId view) const;

  /// How far the matches of a pair lie from where the model that has both its views expects them:
  /// see disagreement_deg() of loop_check. Nothing when no model has both, or it cannot tell.
  [[nodiscard]] std::optional<double> disagreement_deg(ImagePair pair,
                                                       std::span<const FeatureMatch> matches) const;

  /// Adjusts everything with all landmarks, drops what parallax does not support, joins components.
  void finish();

  /// How many views have a pose, in all components.
  [[nodiscard]] std::size_t registered_count() const;
  [[nodiscard]] std::size_t image_count() const;

  /// The models, largest first. Every scene lists all views; those of other components have no pose
  /// there.
  [[nodiscard]] std::vector<Scene> components() const;

  /// One entry an image, in the order of addition.
  [[nodiscard]] std::vector<ImageOutcome> outcomes() const;

 private:
  struct State;
  explicit Mapper(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace trigmesh
