#include "firmware/pipeline/photo_set.hpp"

#include <opencv2/core.hpp>

#include "firmware/base/check.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {

namespace {

// A mask made by hand or scaled has soft edges.
constexpr double kLeaveOutFrom = 128.0;

}  // namespace

PhotoSet subset(const PhotoSet& photos, const std::vector<std::size_t>& positions) {
  PhotoSet result;
  for (const std::size_t i : positions) {
    result.names.push_back(photos.names[i]);
    if (!photos.timestamps.empty()) {
      result.timestamps.push_back(photos.timestamps[i]);
    }
  }
  result.ordered = photos.ordered;
  result.description = photos.description;
  result.warnings = photos.warnings;
  result.read = [&photos, positions](std::size_t i) { return photos.read(positions[i]); };
  if (photos.read_mask) {
    result.read_mask = [&photos, positions](std::size_t i) {
      return photos.read_mask(positions[i]);
    };
  }
  return result;
}

Result<std::optional<std::vector<std::uint8_t>>> read_mask(const PhotoSet& photos,
                                                           std::size_t photo) {
  if (!photos.read_mask) {
    return std::optional<std::vector<std::uint8_t>>();
  }
  return photos.read_mask(photo);
}

Result<cv::Mat> decode_mask(std::span<const std::uint8_t> mask,
                            const std::string& name,
                            int width_px,
                            int height_px) {
  TM_ASSIGN_OR_RETURN(const DecodedImage decoded,
                      decode_image(mask, {.channels = ImageChannels::kGrey}));
  if (decoded.grey.cols != width_px || decoded.grey.rows != height_px) {
    return fail(ErrorCode::kCorruptData,
                "the mask of {} has {}x{} pixels, the photograph {}x{}",
                name,
                decoded.grey.cols,
                decoded.grey.rows,
                width_px,
                height_px);
  }
  return cv::Mat(decoded.grey < kLeaveOutFrom);
}

Result<cv::Mat> load_mask(const PhotoSet& photos, std::size_t photo, int width_px, int height_px) {
  TM_ASSIGN_OR_RETURN(const auto mask, read_mask(photos, photo));
  if (!mask) {
    return cv::Mat();
  }
  return decode_mask(*mask, photos.names[photo], width_px, height_px);
}

}  // namespace trigmesh
