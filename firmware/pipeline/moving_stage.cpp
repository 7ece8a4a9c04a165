#include "firmware/pipeline/moving_stage.hpp"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "sfm/dense/undistortion.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "sfm/moving/moving_regions.hpp"

namespace trigmesh {

namespace {

// Raised with every change of the method: masks of before are then made again.
constexpr std::uint64_t kMethodVersion = 2;
constexpr double kHalfway = 127.0;

double search_scale(const Camera& camera, int side_px) {
  return std::min(1.0, static_cast<double>(side_px) / std::max(camera.width_px, camera.height_px));
}

/// A picture, its mask and its map at the size of the search.
Result<MovingView> moving_view(const DenseInput& input, const DepthMaps& depth, std::size_t i) {
  TM_ASSIGN_OR_RETURN(const ViewImage picture, input.images.load(i));
  TM_ASSIGN_OR_RETURN(const DepthMap map, depth.maps.load(i));
  const DenseView& dense = input.views[i];
  const double scale = search_scale(dense.camera, input.plan.moving_side_px);
  MovingView view;
  view.camera = scaled_pinhole(dense.camera,
                               scaled_side(dense.camera.width_px, scale),
                               scaled_side(dense.camera.height_px, scale));
  view.cam_from_world = dense.cam_from_world;
  view.min_depth = depth.stereo[i].min_depth;
  view.neighbors = depth.stereo[i].neighbors;
  const cv::Size size(view.camera.width_px, view.camera.height_px);
  cv::resize(picture.rgb, view.rgb, size, 0.0, 0.0, cv::INTER_AREA);
  if (!picture.mask.empty()) {
    cv::resize(picture.mask, view.mask, size, 0.0, 0.0, cv::INTER_NEAREST);
  }
  if (!map.depth.empty()) {
    cv::resize(map.depth, view.depth, size, 0.0, 0.0, cv::INTER_NEAREST);
  }
  return view;
}

Result<std::vector<MovingView>> moving_views(const DenseInput& input,
                                             const DepthMaps& depth,
                                             const StageContext& context) {
  std::vector<Result<MovingView>> made(input.views.size());
  context.executor.for_each_index(made.size(),
                                  [&](std::size_t i) { made[i] = moving_view(input, depth, i); });
  std::vector<MovingView> views;
  for (Result<MovingView>& view : made) {
    TM_RETURN_IF_ERROR(view);
    views.push_back(std::move(*view));
  }
  return views;
}

/// A region of the search as a mask of the photograph.
Result<EncodedMask> photograph_mask(const DenseInput& input, std::size_t i, const cv::Mat& region) {
  if (region.empty()) {
    return EncodedMask();
  }
  const DenseView& view = input.views[i];
  cv::Mat full;
  cv::resize(region,
             full,
             cv::Size(view.camera.width_px, view.camera.height_px),
             0.0,
             0.0,
             cv::INTER_LINEAR);
  const cv::Mat sharp = full > kHalfway;
  const Camera& lens = input.scene.cameras[index(input.scene.views[index(view.source)].camera)];
  TM_ASSIGN_OR_RETURN(const cv::Mat mask, distort_mask(sharp, view.camera, lens, 0));
  TM_ASSIGN_OR_RETURN(std::vector<std::uint8_t> png, encode_png(mask));
  return EncodedMask(std::move(png));
}

std::string checkpoint_name(std::size_t view) {
  return fmt::format("moving-{:06}", view);
}

/// The masks of a former run, when all of them are there; no bytes stand for no mask.
std::optional<std::vector<EncodedMask>> stored_masks(const StageContext& context,
                                                     std::size_t count,
                                                     std::uint64_t key) {
  std::vector<EncodedMask> masks;
  for (std::size_t i = 0; i < count; ++i) {
    auto bytes = context.checkpoints.load(checkpoint_name(i), key);
    if (!bytes) {
      return std::nullopt;
    }
    masks.push_back(bytes->empty() ? EncodedMask() : EncodedMask(std::move(*bytes)));
  }
  return masks;
}

/// Two masks of one photograph as one.
Result<std::vector<std::uint8_t>> united(std::span<const std::uint8_t> a,
                                         std::span<const std::uint8_t> b,
                                         const std::string& name) {
  constexpr DecodeOptions kGrey{.channels = ImageChannels::kGrey};
  TM_ASSIGN_OR_RETURN(const DecodedImage first, decode_image(a, kGrey));
  TM_ASSIGN_OR_RETURN(const DecodedImage second, decode_image(b, kGrey));
  if (first.grey.size() != second.grey.size()) {
    return fail(ErrorCode::kCorruptData,
                "the mask of {} has {}x{} pixels, the photograph {}x{}",
                name,
                first.grey.cols,
                first.grey.rows,
                second.grey.cols,
                second.grey.rows);
  }
  return encode_png(cv::max(first.grey, second.grey));
}

std::string mask_name(const std::string& photograph) {
  return (std::filesystem::path("masks") / photograph).replace_extension(".png").generic_string();
}

}  // namespace

Result<std::vector<EncodedMask>> find_moving(const DenseInput& input,
                                             const DepthMaps& depth,
                                             const StageContext& context) {
  const std::size_t count = input.views.size();
  const std::uint64_t key =
      content_hash(fmt::format("{} {} {}", depth.key, kMethodVersion, input.plan.moving_side_px));
  if (auto masks = stored_masks(context, count, key)) {
    return std::move(*masks);
  }
  context.listener.on_progress({Stage::kMoving, 0, 1});
  TM_ASSIGN_OR_RETURN(const std::vector<MovingView> views, moving_views(input, depth, context));
  TM_ASSIGN_OR_RETURN(const std::vector<cv::Mat> regions,
                      find_moving_regions(views, MovingOptions{}, context.executor));
  std::vector<EncodedMask> masks;
  for (std::size_t i = 0; i < count; ++i) {
    TM_ASSIGN_OR_RETURN(EncodedMask mask, photograph_mask(input, i, regions[i]));
    TM_RETURN_IF_ERROR(context.checkpoints.save(
        checkpoint_name(i), key, mask ? *mask : std::vector<std::uint8_t>{}));
    masks.push_back(std::move(mask));
  }
  context.listener.on_progress({Stage::kMoving, 1, 1});
  return masks;
}

PhotoSet with_masks(const PhotoSet& photos,
                    std::span<const DenseView> views,
                    const std::vector<EncodedMask>& masks) {
  std::map<std::string, std::vector<std::uint8_t>, std::less<>> mask_of;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (masks[i]) {
      mask_of.emplace(views[i].name, *masks[i]);
    }
  }
  PhotoSet result = photos;
  result.read_mask = [&photos, mask_of = std::move(mask_of)](std::size_t i) -> Result<EncodedMask> {
    TM_ASSIGN_OR_RETURN(EncodedMask own, read_mask(photos, i));
    const auto found = mask_of.find(photos.names[i]);
    if (found == mask_of.end()) {
      return own;
    }
    if (!own) {
      return EncodedMask(found->second);
    }
    TM_ASSIGN_OR_RETURN(auto both, united(*own, found->second, photos.names[i]));
    return EncodedMask(std::move(both));
  };
  return result;
}

std::vector<NamedFile> mask_files(std::span<const DenseView> views,
                                  const std::vector<EncodedMask>& masks) {
  std::vector<NamedFile> files;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (masks[i]) {
      files.push_back({mask_name(views[i].name), std::string(masks[i]->begin(), masks[i]->end())});
    }
  }
  return files;
}

Result<MovingSection> sum_up_masks(std::span<const DenseView> views,
                                   const std::vector<EncodedMask>& masks) {
  MovingSection section;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!masks[i]) {
      continue;
    }
    TM_ASSIGN_OR_RETURN(const DecodedImage mask,
                        decode_image(*masks[i], {.channels = ImageChannels::kGrey}));
    const double ratio =
        static_cast<double>(cv::countNonZero(mask.grey)) / static_cast<double>(mask.grey.total());
    section.images.push_back({views[i].name, ratio});
    section.masked_ratio += ratio / static_cast<double>(views.size());
  }
  return section;
}

}  // namespace trigmesh
