#pragma once

#include <optional>
#include <string_view>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// Where a reconstruction ends.
enum class LastStage { kSparse, kDense, kMesh, kTexture };

/// "sparse", "dense", "mesh", "texture".
[[nodiscard]] std::string_view to_string(LastStage stage);
[[nodiscard]] std::optional<LastStage> last_stage_from_string(std::string_view name);

/// How fine the stages after mapping work.
enum class QualityPreset {
  kPreview,   ///< a surface from the sparse points alone, in seconds; no depth maps
  kStandard,  ///< depth maps at half the image size, at least 640 pixels wide where images are
  kFine,      ///< depth maps at the size of the images, up to 1600 pixels
};

/// "preview", "standard", "fine".
[[nodiscard]] std::string_view to_string(QualityPreset preset);
[[nodiscard]] std::optional<QualityPreset> quality_preset_from_string(std::string_view name);

/// What becomes of things that moved while the photographs were taken.
enum class MovingUse {
  kAuto,  ///< they are looked for in the depth maps and left out of everything after these
  kOff,   ///< they are not looked for
};

/// "auto", "off".
[[nodiscard]] std::string_view to_string(MovingUse use);
[[nodiscard]] std::optional<MovingUse> moving_use_from_string(std::string_view name);

/// Settings of the stages after mapping.
struct BuildOptions {
  LastStage last_stage = LastStage::kTexture;
  QualityPreset preset = QualityPreset::kStandard;
  /// Most triangles of the mesh, [0, 50 million]; 0: what the preset says.
  int max_faces = 0;
  /// Longer side of the depth maps, pixels, 0 or [64, 8192]; 0: what the preset says. Never larger
  /// than the photographs.
  int map_side_px = 0;
  /// Largest side of a texture page, pixels, a power of two in [256, 16384].
  int texture_size_px = 4096;
  MovingUse moving = MovingUse::kAuto;

  [[nodiscard]] Result<> validate() const;
};

}  // namespace trigmesh
