// Matches of two synthetic cameras with known relative pose.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "tests/unit/sfm/geometry/synthetic.hpp"

namespace trigmesh::synthetic {

enum class Structure { kVolume, kPlane, kInfinity };

struct TwoViewOptions {
  std::size_t count = 100;
  double outlier_ratio = 0.0;  ///< the first so many matches are wrong
  double noise_px = 0.0;
  Structure structure = Structure::kVolume;
  Camera camera = pinhole();
  double baseline = 1.0;  ///< 0: pure rotation
};

struct TwoViewMatches {
  Camera camera;
  Rigid3 second_from_first;
  std::vector<Eigen::Vector2d> first_px, second_px;  ///< measured
  std::vector<Eigen::Vector2d> first, second;        ///< normalised coordinates
};

/// Points 3 to 9 in front of the first camera that both cameras see.
inline TwoViewMatches make_two_view(Random& random, const TwoViewOptions& options) {
  TwoViewMatches out{.camera = options.camera,
                     .second_from_first = {},
                     .first_px = {},
                     .second_px = {},
                     .first = {},
                     .second = {}};
  const Eigen::Vector3d axis = random.in_box(1.0).normalized();
  const Eigen::Vector3d shift = random.in_box(1.0).normalized();
  out.second_from_first = {Eigen::Quaterniond(Eigen::AngleAxisd(random.uniform(0.02, 0.2), axis)),
                           options.baseline * shift};
  const auto wrong =
      static_cast<std::size_t>(options.outlier_ratio * static_cast<double>(options.count));
  const Camera& camera = options.camera;
  while (out.first_px.size() < options.count) {
    const Eigen::Vector2d any = random.in_rectangle(camera.width_px, camera.height_px);
    const auto uv = normalize_pixel(camera, any);
    if (!uv) {
      continue;
    }
    double depth = random.uniform(3.0, 9.0);
    if (options.structure == Structure::kPlane) {
      depth = 5.0 / (1.0 + 0.3 * uv->x() - 0.2 * uv->y());
    } else if (options.structure == Structure::kInfinity) {
      depth = 1e9;
    }
    const Eigen::Vector3d in_second =
        out.second_from_first * (depth * Eigen::Vector3d(uv->homogeneous()));
    auto pixel = in_second.z() > 0.2 ? project(camera, in_second) : std::nullopt;
    if (!pixel || pixel->minCoeff() < 0.0 || pixel->x() > camera.width_px ||
        pixel->y() > camera.height_px) {
      continue;
    }
    Eigen::Vector2d second = *pixel + random.gauss2(options.noise_px);
    if (out.first_px.size() < wrong) {
      second = random.in_rectangle(camera.width_px, camera.height_px);
    }
    const Eigen::Vector2d first = any + random.gauss2(options.noise_px);
    const auto first_uv = normalize_pixel(camera, first);
    const auto second_uv = normalize_pixel(camera, second);
    if (first_uv && second_uv) {
      out.first_px.push_back(first);
      out.second_px.push_back(second);
      out.first.push_back(*first_uv);
      out.second.push_back(*second_uv);
    }
  }
  return out;
}

}  // namespace trigmesh::synthetic
