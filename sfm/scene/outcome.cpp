#include "sfm/scene/outcome.hpp"

namespace trigmesh {

// No default label: the compiler names a reason that is missing here.

std::string_view to_string(RefusalReason reason) {
  switch (reason) {
    case RefusalReason::kNone:
      return "registered";
    case RefusalReason::kUnreadable:
      return "unreadable";
    case RefusalReason::kTooSmall:
      return "too_small";
    case RefusalReason::kTooFewFeatures:
      return "too_few_features";
    case RefusalReason::kDuplicate:
      return "duplicate";
    case RefusalReason::kNoOverlap:
      return "no_overlap";
    case RefusalReason::kPureRotation:
      return "pure_rotation";
    case RefusalReason::kNoParallax:
      return "no_parallax";
    case RefusalReason::kTooFewMapMatches:
      return "too_few_map_matches";
    case RefusalReason::kPoseRejected:
      return "pose_rejected";
    case RefusalReason::kPoseUnstable:
      return "pose_unstable";
    case RefusalReason::kOtherComponent:
      return "other_component";
    case RefusalReason::kNoGivenPose:
      return "no_given_pose";
  }
  return "unknown";
}

std::string_view advice(RefusalReason reason) {
  switch (reason) {
    case RefusalReason::kNone:
      return "";
    case RefusalReason::kUnreadable:
      return "Copy the file again from the camera, or take the picture once more: this one is "
             "missing, cut short or not a JPEG or PNG.";
    case RefusalReason::kTooSmall:
      return "Give the original picture instead of a thumbnail: at least 32 pixels on each side "
             "are needed, 640 or more are recommended.";
    case RefusalReason::kTooFewFeatures:
      return "Hold the camera still, bring more light, and keep something with texture in view: "
             "blank walls, glass, mirrors and blur give nothing to hold on to.";
    case RefusalReason::kDuplicate:
      return "Nothing to do: the same picture is already in the model. To add to it, take a step "
             "to the side before the next shot.";
    case RefusalReason::kNoOverlap:
      return "Take more pictures between this place and its neighbours, so that each shows at "
             "least two thirds of what the one before it shows.";
    case RefusalReason::kPureRotation:
      return "Walk sideways while you turn: turning on the spot shows no depth. Take this view "
             "again from a place one or two steps away.";
    case RefusalReason::kNoParallax:
      return "Step further to the side between shots: about one tenth of the distance to the "
             "object is enough.";
    case RefusalReason::kTooFewMapMatches:
      return "Take two or three pictures on the way from the nearest picture in the model to this "
             "one, with small steps and small turns.";
    case RefusalReason::kPoseRejected:
      return "Keep people, leaves and screens out of view or wait until they stand still, check "
             "that zoom and camera settings are those of the other pictures, and take it again.";
    case RefusalReason::kPoseUnstable:
      return "Take this view again from slightly closer and from two sides: too few points held "
             "it in place.";
    case RefusalReason::kOtherComponent:
      return "Take a chain of overlapping pictures from the main part to this one: both parts were "
             "built, but nothing links them.";
    case RefusalReason::kNoGivenPose:
      return "Add a pose for this picture to the given model, or leave out --poses so that it is "
             "solved.";
  }
  return "";
}

}  // namespace trigmesh
