#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"
#include "sfm/texture/atlas_layout.hpp"
#include "sfm/texture/face_views.hpp"
#include "sfm/texture/textured_mesh.hpp"

namespace trigmesh {

struct TextureOptions {
  VisibilityOptions visibility;
  AtlasOptions atlas;
  /// Price of a seam edge against the loss of quality on one face (0 best view, 1000 worthless),
  /// [0, 100000]. More gives larger charts from views that see less well.
  int seam_cost = 1000;
  /// Views considered for a face, best first, [1, 64]. Bounds time and memory of the labelling.
  int max_candidates = 16;
  /// Passes over all views in the labelling, [1, 20].
  int labeling_sweeps = 2;

  [[nodiscard]] Result<> validate() const;
};

struct TextureReport {
  std::size_t face_count = 0;           ///< after splitting
  std::size_t added_face_count = 0;     ///< by splitting those that no view saw whole
  std::size_t textured_face_count = 0;  ///< the others have colours, but no picture
  std::size_t view_count = 0;
  std::size_t used_view_count = 0;      ///< views of which something is in the atlas
  std::size_t rejected_look_count = 0;  ///< (face, view) pairs rejected as colour outliers
  std::size_t chart_count = 0;          ///< rectangles of pictures in the atlas
  int page_count = 0;
  int page_size_px = 0;
  double atlas_fill_ratio = 0.0;  ///< area of the chart rectangles / area of the pages
  double texels_per_pixel = 0.0;  ///< of the pictures, along each axis
  double texel_size = 0.0;        ///< median over the textured faces, world units
  double smallest_gain = 1.0;     ///< of the views' exposure levelling, over the channels
  double largest_gain = 1.0;
  double seam_step_before = 0.0;  ///< see SeamLeveling
  double seam_step_after_gains = 0.0;
  double seam_step_after = 0.0;
  std::vector<std::string> lowered_quality;  ///< a sentence for each declared step down
};

struct TextureResult {
  TexturedMesh textured;
  TextureReport report;
};

/// Puts the pictures of the views on the mesh: faces that only parts of are seen are split; which
/// views see which face and how well; their exposures levelled; views that disagree rejected; one
/// view a face with few seams; charts packed on pages; colours levelled across the seams. Faces
/// that no view sees continue the colours around them or, far from any picture, have the mesh's
/// vertex colours.
///
/// `views` are pinhole cameras; pictures are loaded twice, one at a time in each thread of
/// `executor`. Deterministic, whatever the executor. kInvalidArgument: options, a view without a
/// pinhole camera, faces that name vertices which do not exist; kInsufficientData: no face or no
/// view; kLimitExceeded: the atlas is too small; what `images` returns.
[[nodiscard]] Result<TextureResult> texture_surface(const TriangleMesh& mesh,
                                                    std::span<const DenseView> views,
                                                    const ViewImageSource& images,
                                                    const TextureOptions& options,
                                                    Executor& executor);

}  // namespace trigmesh
