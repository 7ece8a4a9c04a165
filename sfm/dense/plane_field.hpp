#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "sfm/camera/camera.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/dense/patch_match_kernel.hpp"

namespace trigmesh {

/// What PatchMatch knows about one resolution of a reference view: a plane for every pixel.
struct PlaneField {
  int width_px = 0;
  int height_px = 0;
  std::vector<PlaneHypothesis> planes;  ///< row by row; inverse depth 0: none
  std::vector<float> cost;              ///< of the plane, weighted over the views; [0, 2]
  std::vector<std::uint8_t> view_set;   ///< bit s: source s is thought to see the pixel

  PlaneField() = default;
  PlaneField(int width, int height);

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) +
           static_cast<std::size_t>(x);
  }
};

/// Depths between which planes are looked for, as inverse depth: 0 < min < max.
struct InverseDepthRange {
  float min = 0.0F;
  float max = 0.0F;
};

/// The plane with a normal (camera frame, any length and sign) and an inverse depth at a pixel.
[[nodiscard]] PlaneHypothesis plane_from_normal(const Camera& camera,
                                                const Eigen::Vector2f& pixel,
                                                float inverse_depth,
                                                const Eigen::Vector3f& normal_in_cam);

/// Unit normal in the camera frame, towards the camera, of a plane at a pixel.
[[nodiscard]] Eigen::Vector3f normal_of_plane(const Camera& camera,
                                              const Eigen::Vector2f& pixel,
                                              const PlaneHypothesis& plane);

/// The field that a finished map stands for; cost and view set are left at their defaults.
[[nodiscard]] PlaneField field_from_depth_map(const DepthMap& map);

/// Depth, normal and a confidence that falls with the cost: 255 for a perfect match, at least 1
/// where there is a plane.
[[nodiscard]] DepthMap depth_map_from_field(const PlaneField& field, const Camera& camera);

/// The same surface at another size of the image.
[[nodiscard]] PlaneField resample_field(const PlaneField& field, int width_px, int height_px);

/// A first surface from sparse points (camera frame): planes over the Delaunay triangles of their
/// pixels, flat pieces at the nearest point outside of them. No plane anywhere when no point is in
/// the picture.
[[nodiscard]] PlaneField field_from_seeds(const Camera& camera,
                                          std::span<const Eigen::Vector3f> seeds_in_cam,
                                          const InverseDepthRange& range);

}  // namespace trigmesh
