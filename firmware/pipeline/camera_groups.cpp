#include "firmware/pipeline/camera_groups.hpp"

#include <cmath>
#include <map>
#include <tuple>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

// A guess that only holds until the epipolar geometry has voted.
constexpr double kDefaultFocalRatio = 1.2;
constexpr double kAspectTolerance = 0.002;

using GroupKey = std::tuple<int, int, std::string>;

GroupKey key_of(const GroupingImage& image, GroupingMode mode) {
  const ImageFeatures& features = *image.features;
  switch (mode) {
    case GroupingMode::kSingle:
      return {features.width_px, features.height_px, ""};
    case GroupingMode::kPerFolder:
      return {features.width_px,
              features.height_px,
              image.name.substr(0, image.name.find_last_of('/') + 1)};
    case GroupingMode::kPerImage:
      return {features.width_px, features.height_px, image.name};
    case GroupingMode::kAuto:
      break;
  }
  return {features.width_px, features.height_px, features.camera_key};
}

CameraGroup group_without_profile(const ImageFeatures& image) {
  CameraGroup group;
  group.camera.model = CameraModel::kRadial;
  group.camera.width_px = image.width_px;
  group.camera.height_px = image.height_px;
  group.camera.cx_px = 0.5 * (image.width_px - 1);
  group.camera.cy_px = 0.5 * (image.height_px - 1);
  const bool has_exif = image.exif_focal_px > 0.0;
  const double focal_px = has_exif ? image.exif_focal_px
                                   : kDefaultFocalRatio * std::max(image.width_px, image.height_px);
  group.camera.fx_px = group.camera.fy_px = focal_px;
  group.knowledge = has_exif ? IntrinsicsKnowledge::kPrior : IntrinsicsKnowledge::kUnknown;
  return group;
}

/// The intrinsics of the same lens for a picture resized by `ratio`. The corner of the picture,
/// (-0.5, -0.5), stays.
Camera resized(Camera camera, int width_px, int height_px) {
  const double ratio = static_cast<double>(width_px) / camera.width_px;
  camera.fx_px *= ratio;
  camera.fy_px *= ratio;
  camera.cx_px = (camera.cx_px + 0.5) * ratio - 0.5;
  camera.cy_px = (camera.cy_px + 0.5) * ratio - 0.5;
  camera.width_px = width_px;
  camera.height_px = height_px;
  return camera;
}

bool same_aspect(const Camera& camera, const ImageFeatures& image) {
  const double a = static_cast<double>(camera.width_px) / camera.height_px;
  const double b = static_cast<double>(image.width_px) / image.height_px;
  return std::abs(a / b - 1.0) < kAspectTolerance;
}

Result<Camera> given_camera_for(const GroupingImage& image, const std::vector<Camera>& given) {
  const ImageFeatures& features = *image.features;
  std::vector<Camera> exact;
  std::vector<Camera> scaled;
  for (const Camera& camera : given) {
    if (camera.width_px == features.width_px && camera.height_px == features.height_px) {
      exact.push_back(camera);
    } else if (same_aspect(camera, features)) {
      scaled.push_back(resized(camera, features.width_px, features.height_px));
    }
  }
  const std::vector<Camera>& fitting = exact.empty() ? scaled : exact;
  if (fitting.size() == 1) {
    return fitting.front();
  }
  if (fitting.empty()) {
    return fail(ErrorCode::kInvalidArgument,
                "cannot use the given camera for {}: the image has {}x{} pixels, the first given "
                "camera {}x{}; give the "
                "profile of the camera that took it, or leave --camera out",
                image.name,
                features.width_px,
                features.height_px,
                given.front().width_px,
                given.front().height_px);
  }
  return fail(ErrorCode::kInvalidArgument,
              "cannot choose a camera for {}: {} of the given cameras have its size; give a file "
              "with one camera per size",
              image.name,
              fitting.size());
}

}  // namespace

std::optional<GroupingMode> grouping_mode_from_string(std::string_view name) {
  if (name == "auto") {
    return GroupingMode::kAuto;
  }
  if (name == "single") {
    return GroupingMode::kSingle;
  }
  if (name == "folder") {
    return GroupingMode::kPerFolder;
  }
  if (name == "image") {
    return GroupingMode::kPerImage;
  }
  return std::nullopt;
}

Result<CameraGroups> group_cameras(const std::vector<GroupingImage>& images,
                                   const std::vector<Camera>& given,
                                   GroupingMode mode) {
  CameraGroups result;
  std::map<GroupKey, CameraId> known;
  for (const GroupingImage& image : images) {
    if (image.features == nullptr) {
      result.group_of_image.push_back(CameraId{0});
      continue;
    }
    const auto [place, is_new] =
        known.try_emplace(key_of(image, mode), id_of<CameraId>(result.groups.size()));
    if (is_new && mode == GroupingMode::kSingle && known.size() > 1) {
      return fail(ErrorCode::kInvalidArgument,
                  "cannot treat all images as one camera: {} has {}x{} pixels, unlike those before "
                  "it; use --camera-groups auto",
                  image.name,
                  image.features->width_px,
                  image.features->height_px);
    }
    if (is_new && given.empty()) {
      result.groups.push_back(group_without_profile(*image.features));
    } else if (is_new) {
      TM_ASSIGN_OR_RETURN(const Camera camera, given_camera_for(image, given));
      result.groups.push_back({camera, IntrinsicsKnowledge::kGiven});
    }
    result.group_of_image.push_back(place->second);
  }
  return result;
}

}  // namespace trigmesh
