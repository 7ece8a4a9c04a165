#include "firmware/pipeline/photo_set.hpp"

#include <opencv2/core.hpp>

#include "firmware/base/check.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {

namespace {

// A mask made by hand or scaled has soft edges.
constexpr double kLeaveOutFrom = 128.0;

}  // namespace

Result<cv::Mat> load_mask(const PhotoSet& photos, std::size_t photo, int width_px, int height_px) {
  if (!photos.read_mask) {
    return cv::Mat();
  }
  TM_ASSIGN_OR_RETURN(const auto bytes, photos.read_mask(photo));
  if (!bytes) {
    return cv::Mat();
  }
  TM_ASSIGN_OR_RETURN(const DecodedImage decoded,
                      decode_image(*bytes, {.channels = ImageChannels::kGrey}));
  if (decoded.grey.cols != width_px || decoded.grey.rows != height_px) {
    return fail(ErrorCode::kCorruptData,
                "the mask of {} has {}x{} pixels, the photograph {}x{}",
                photos.names[photo],
                decoded.grey.cols,
                decoded.grey.rows,
                width_px,
                height_px);
  }
  return cv::Mat(decoded.grey < kLeaveOutFrom);
}

}  // namespace trigmesh
