#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/camera/frame_source.hpp"

namespace trigmesh::conformance {

/// How one test asks for a camera.
struct CameraWish {
  /// Frames that come at once, for backends that can say so; a device just runs.
  std::size_t frame_count = 0;
};

/// A backend as the suite sees it. Pictures that a backend cannot be asked for are left out of the
/// suite by `is_scripted`; every other promise of FrameSource is tested on each.
struct CameraBackend {
  std::string name;
  /// Delivers exactly the frames of the wish, then nothing: neither a frame nor an end.
  bool is_scripted = false;
  /// Whether a consumer that holds all buffers loses frames.
  bool loses_frames = false;
  std::function<std::unique_ptr<FrameSource>(const CameraWish&)> make;
};

/// Backends that run here: replay and mock always; v4l2 and libcamera when the environment names a
/// device (TRIGMESH_TEST_V4L2=/dev/video0, TRIGMESH_TEST_LIBCAMERA=NAME or first). Those that do
/// not run are named in `skipped` with the reason.
struct CameraBackends {
  std::vector<CameraBackend> running;
  std::vector<std::string> skipped;
};

[[nodiscard]] const CameraBackends& camera_backends();

}  // namespace trigmesh::conformance
