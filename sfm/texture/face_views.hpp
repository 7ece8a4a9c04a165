#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// How one view sees one face.
struct FaceView {
  std::uint32_t view = 0;
  float quality = 0.0F;  ///< > 0; larger is better; comparable among the views of one face
  /// Mean red, green, blue over the face's pixels, in 1/kColorUnits grey levels.
  std::array<std::uint16_t, 3> color{};
};

inline constexpr float kColorUnits = 256.0F;

/// Per face the views that see it, ascending by view. Face f owns entries [offsets[f],
/// offsets[f + 1]).
struct FaceViews {
  std::vector<std::size_t> offsets;
  std::vector<FaceView> entries;
  /// Faces that no view sees whole, but of which some view sees more than a few pixels; ascending.
  /// Split, they may be seen.
  std::vector<std::uint32_t> worth_splitting;

  [[nodiscard]] std::size_t face_count() const { return offsets.size() - 1; }

  [[nodiscard]] std::span<const FaceView> of(std::size_t face) const {
    return std::span(entries).subspan(offsets[face], offsets[face + 1] - offsets[face]);
  }
};

struct VisibilityOptions {
  /// Smallest cosine between the face's normal and the direction to the camera, (0, 1). Pictures
  /// taken at a grazing angle are stretched and show the wrong thing where the mesh is off a
  /// little; they are makeshift.
  double min_view_cosine = 0.2;
  /// Within this distance of a jump in depth a pixel may belong to the other side, because no mesh
  /// and no pose is exact; pixels, [0, 64]. Faces there are taken only if no other view is clear.
  int silhouette_margin_px = 3;

  [[nodiscard]] Result<> validate() const;
};

/// Looks at the mesh from every view, one at a time in each thread: projects it into a z-buffer and
/// lists the faces that lie wholly inside the picture, face the camera, and are neither hidden by
/// another part of the mesh nor masked. Quality is projected area times cosine times sharpness
/// (mean gradient of the picture), lowered near silhouettes. Makeshift looks are listed too, of a
/// fiftieth of that quality: at grazing angles, and with a few hidden pixels, fewer than are seen.
/// Colours are those of the pixels that are not hidden. Memory: one picture and one depth
/// raster a thread, 12 bytes a face and view that sees it. Errors are those of `images`;
/// kInvalidArgument when a picture has not the size of its camera.
[[nodiscard]] Result<FaceViews> find_face_views(const TriangleMesh& mesh,
                                                std::span<const DenseView> views,
                                                const ViewImageSource& images,
                                                const VisibilityOptions& options,
                                                Executor& executor);

/// The picture of a view, checked against the view's camera.
[[nodiscard]] Result<ViewImage> load_view(std::span<const DenseView> views,
                                          const ViewImageSource& images,
                                          std::size_t view);

/// CV_8UC1: 255 at pixels within `margin_px` of a jump of `inverse_depth` (see
/// render_inverse_depth), else 0. A jump is a second difference of more than four pixels'
/// footprint.
[[nodiscard]] cv::Mat silhouette_mask(const cv::Mat& inverse_depth, double focal_px, int margin_px);

}  // namespace trigmesh
