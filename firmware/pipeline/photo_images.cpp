#include "firmware/pipeline/photo_images.hpp"

#include <functional>
#include <map>
#include <string>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/checkpoint.hpp"
#include "sfm/dense/undistortion.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {

Result<PhotoImages> PhotoImages::create(const PhotoSet& photos,
                                        const Scene& scene,
                                        const std::vector<DenseView>& views) {
  std::map<std::string, std::size_t, std::less<>> photo_of;
  for (std::size_t i = 0; i < photos.names.size(); ++i) {
    photo_of.emplace(photos.names[i], i);
  }
  std::vector<Item> items;
  for (const DenseView& view : views) {
    const auto found = photo_of.find(view.name);
    if (found == photo_of.end()) {
      return fail(
          ErrorCode::kNotFound,
          "the model has an image {}, but there is no photograph of that name among the {} given",
          view.name,
          photos.names.size());
    }
    const View& source = scene.views[index(view.source)];
    items.push_back({found->second, scene.cameras[index(source.camera)], view.camera});
  }
  return PhotoImages(photos, std::move(items));
}

Result<ViewImage> PhotoImages::load(std::size_t view) const {
  const Item& item = items_[view];
  TM_ASSIGN_OR_RETURN(const auto bytes, photos_->read(item.photo));
  TM_ASSIGN_OR_RETURN(DecodedImage decoded, decode_image(bytes, {.channels = ImageChannels::kRgb}));
  if (decoded.rgb.cols != item.lens.width_px || decoded.rgb.rows != item.lens.height_px) {
    return fail(ErrorCode::kInvalidArgument,
                "{} has {}x{} pixels, its camera in the model {}x{}",
                photos_->names[item.photo],
                decoded.rgb.cols,
                decoded.rgb.rows,
                item.lens.width_px,
                item.lens.height_px);
  }
  TM_ASSIGN_OR_RETURN(cv::Mat mask,
                      load_mask(*photos_, item.photo, item.lens.width_px, item.lens.height_px));
  return undistort_image({std::move(decoded.rgb), std::move(mask)}, item.lens, item.pinhole);
}

Result<std::uint64_t> PhotoImages::content(std::size_t view) const {
  const Item& item = items_[view];
  TM_ASSIGN_OR_RETURN(const auto bytes, photos_->read(item.photo));
  TM_ASSIGN_OR_RETURN(const auto mask, read_mask(*photos_, item.photo));
  const std::uint64_t hash = content_hash(bytes);
  return mask ? content_hash(*mask, hash) : hash;
}

}  // namespace trigmesh
