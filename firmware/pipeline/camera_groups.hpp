#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/image_features.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/mapping/mapper.hpp"

namespace trigmesh {

/// Which images share one set of intrinsics.
enum class GroupingMode {
  kAuto,       ///< same size and same camera, lens and focal length by EXIF
  kSingle,     ///< one camera took all; their sizes must be equal
  kPerFolder,  ///< one camera for each subfolder and size
  kPerImage,   ///< every image has its own
};

/// "auto", "single", "folder", "image".
[[nodiscard]] std::optional<GroupingMode> grouping_mode_from_string(std::string_view name);

/// One camera group and how much is known of it.
struct CameraGroup {
  Camera camera;
  IntrinsicsKnowledge knowledge = IntrinsicsKnowledge::kUnknown;
};

/// The groups of a set of images.
struct CameraGroups {
  std::vector<CameraGroup> groups;
  std::vector<CameraId> group_of_image;  ///< per image
};

/// What grouping looks at; images that could not be read have width 0 and fall into group 0.
struct GroupingImage {
  std::string name;
  const ImageFeatures* features = nullptr;  ///< null for an unreadable image
};

/// Sorts images into camera groups. A group whose size one of the `given` cameras has takes it
/// (kGiven). A given camera of another size but the same aspect ratio is scaled, as the photographs
/// are then resized ones; any other size is kInvalidArgument, and so is a choice between two given
/// cameras. Without a given camera, EXIF's focal length is the prior (kPrior), else nothing is
/// known (kUnknown); both get the radial model with the principal point in the middle.
[[nodiscard]] Result<CameraGroups> group_cameras(const std::vector<GroupingImage>& images,
                                                 const std::vector<Camera>& given,
                                                 GroupingMode mode);

}  // namespace trigmesh
