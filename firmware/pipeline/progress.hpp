#pragma once

#include <cstddef>
#include <string_view>

namespace trigmesh {

/// The stages of a reconstruction, in order.
enum class Stage {
  kReadVideo,     ///< video file -> frames
  kSelectFrames,  ///< video -> keyframes
  kExtract,       ///< photographs -> keypoints and descriptors
  kSelectPairs,   ///< which images are worth comparing
  kMatch,         ///< pairs -> verified matches
  kMap,           ///< images -> poses and points
  kScale,         ///< photographs with markers -> metres
  kDepth,         ///< views -> depth maps
  kMoving,        ///< depth maps and photographs -> masks of what moved
  kFuse,          ///< depth maps -> dense cloud
  kSurface,       ///< depth maps -> mesh
  kTexture,       ///< mesh and views -> textured mesh
  kWrite,         ///< model and report -> files
};

/// "video", "frames", "features", "pairs", "matching", "mapping", "scale", "depth", "moving",
/// "fusion", "surface", "texture", "writing".
[[nodiscard]] std::string_view to_string(Stage stage);

/// How far a stage is. `total` may be 0 while it is not known.
struct Progress {
  Stage stage = Stage::kExtract;
  std::size_t done = 0;
  std::size_t total = 0;
};

/// Is told how work goes on. Thread-safe: stages report from worker threads.
class ProgressListener {
 public:
  ProgressListener() = default;
  ProgressListener(const ProgressListener&) = delete;
  ProgressListener& operator=(const ProgressListener&) = delete;
  ProgressListener(ProgressListener&&) = delete;
  ProgressListener& operator=(ProgressListener&&) = delete;
  virtual ~ProgressListener() = default;

  virtual void on_progress(const Progress& progress) = 0;

  /// A piece of work was finished, small or large, many a second: a sign that work gets on also in
  /// a stage that cannot count its pieces.
  virtual void on_work() {}
};

}  // namespace trigmesh
