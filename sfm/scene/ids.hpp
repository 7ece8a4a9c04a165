#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace trigmesh {

// Strong identifiers: each is a position in the vector that holds its things.

/// Position in Scene::views.
enum class ViewId : std::uint32_t {};
/// Position in Scene::cameras: the group of images that share one set of intrinsics.
enum class CameraId : std::uint32_t {};
/// Position in Scene::landmarks.
enum class LandmarkId : std::uint32_t {};
/// Position of a keypoint in its view.
enum class FeatureIndex : std::uint32_t {};

inline constexpr LandmarkId kNoLandmark{std::numeric_limits<std::uint32_t>::max()};

/// `views[index(id)]`.
template <typename Id>
[[nodiscard]] constexpr std::size_t index(Id id) {
  return static_cast<std::size_t>(id);
}

/// The identifier of a position: `id_of<ViewId>(i)`.
template <typename Id>
[[nodiscard]] constexpr Id id_of(std::size_t position) {
  return static_cast<Id>(static_cast<std::uint32_t>(position));
}

}  // namespace trigmesh
