#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace trigmesh {

/// Why an image has no pose in the model: a closed list. `advice` turns each into words for the
/// operator.
enum class RefusalReason {
  kNone,            ///< registered
  kUnreadable,      ///< the file is missing, truncated or not a picture
  kTooSmall,        ///< fewer than 32 pixels on a side
  kTooFewFeatures,  ///< blur, darkness or no texture
  kDuplicate,       ///< the same picture as another one: adds nothing
  kNoOverlap,       ///< no other image shows enough of the same things
  kPureRotation,    ///< overlaps, but the camera only turned: no parallax, so no depth
  kNoParallax,      ///< overlaps, but stood too near to the others for the distance of what it sees
  kTooFewMapMatches,  ///< overlaps with registered images, but sees too few points of the model
  kPoseRejected,      ///< enough points seen, but no pose explains them (moving things, look-alike
                      ///< places, wrong intrinsics)
  kPoseUnstable,      ///< a pose was found and lost again in adjustment
  kOtherComponent,    ///< registered in another part that has no link to the main model
  kNoGivenPose,       ///< poses were given, and none for this image
};

/// All of them, in the order above.
inline constexpr std::array kAllRefusalReasons{
    RefusalReason::kNone,
    RefusalReason::kUnreadable,
    RefusalReason::kTooSmall,
    RefusalReason::kTooFewFeatures,
    RefusalReason::kDuplicate,
    RefusalReason::kNoOverlap,
    RefusalReason::kPureRotation,
    RefusalReason::kNoParallax,
    RefusalReason::kTooFewMapMatches,
    RefusalReason::kPoseRejected,
    RefusalReason::kPoseUnstable,
    RefusalReason::kOtherComponent,
    RefusalReason::kNoGivenPose,
};

/// "registered" for kNone, else the snake_case name without k: "unreadable", "no_overlap", ...
[[nodiscard]] std::string_view to_string(RefusalReason reason);
/// One sentence for the operator: what to do so that the image (or its place) gets into the model.
/// Empty for kNone.
[[nodiscard]] std::string_view advice(RefusalReason reason);

/// What became of one image, with the numbers that decided it.
struct ImageOutcome {
  std::string name;
  RefusalReason reason = RefusalReason::kNone;
  std::string detail;  ///< one sentence with the numbers, e.g. "14 of 230 map matches agree with
                       ///< one pose, 30 are needed"
  std::size_t features = 0;
  std::size_t overlapping_images = 0;  ///< verified pairs it is part of
  std::size_t map_matches = 0;         ///< 2D-3D candidates at the last try
  std::size_t map_inliers = 0;         ///< of these, agreeing with the pose
  std::size_t observations = 0;        ///< keypoints that see a landmark in the final model
  double rmse_px = 0.0;                ///< of these, root mean square reprojection error
  int component = -1;                  ///< which model it is part of, 0 = main; -1 none
};

}  // namespace trigmesh
