#pragma once

#include <cstddef>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// The photographs of a scene's registered views, decoded and undistorted whenever they are asked
/// for: nothing is kept in memory.
class PhotoImages final : public ViewImageSource {
 public:
  /// `photos` and `scene` outlive the object; `views` are the scene's (dense_views). kNotFound when
  /// a view has no photograph of its name.
  [[nodiscard]] static Result<PhotoImages> create(const PhotoSet& photos,
                                                  const Scene& scene,
                                                  const std::vector<DenseView>& views);

  /// Also kInvalidArgument when the photograph has another size than its camera.
  [[nodiscard]] Result<ViewImage> load(std::size_t view) const override;

  /// Hash of the photograph and its mask, for the keys of what is made of them.
  [[nodiscard]] Result<std::uint64_t> content(std::size_t view) const;

 private:
  struct Item {
    std::size_t photo = 0;
    Camera lens;     ///< of the photograph
    Camera pinhole;  ///< of the view
  };

  PhotoImages(const PhotoSet& photos, std::vector<Item> items)
      : photos_(&photos), items_(std::move(items)) {}

  const PhotoSet* photos_;
  std::vector<Item> items_;
};

}  // namespace trigmesh
