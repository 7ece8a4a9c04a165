#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "firmware/pipeline/report.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// What the 3D view of the report page draws, as JSON text:
/// {"point_limit": most points kept,
///  "components": [{"points": kept, "points_total": all, "poses": [{"image": row of report.images,
///  "camera": position in
///                  report.cameras, "center": [x, y, z] in world, "rotation": world_from_cam
///                  quaternion [x, y, z, w]}]}],
///  "positions": base64 of float32 little-endian x y z, "colors": base64 of bytes r g b; kept
///  points of all components, "visibility": base64 of unsigned LEB128 numbers: for each pose in
///  order how many kept points it sees, then their
///                positions in the component, ascending, each as the difference to the one before}
/// Thinning keeps evenly spaced landmarks, so that at most about `point_limit` remain over all
/// components.
[[nodiscard]] std::string render_report_geometry(const ReconstructionReport& report,
                                                 std::span<const Scene> components,
                                                 std::size_t point_limit);

}  // namespace trigmesh
