#include "firmware/pipeline/video_frames.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/pipeline/named_value.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {

namespace {

// A camera that a person carries shows much the same after this time.
constexpr std::chrono::milliseconds kLongestVideoInterval{100};
// Frames decoded before the selector looks at them in turn: enough to keep all threads at work.
constexpr std::size_t kBatch = 16;

constexpr std::array kFrameUses{
    FrameUse::kAuto, FrameUse::kAll, FrameUse::kKeyframes, FrameUse::kWalk};

bool is_video(const PhotoSet& photos) {
  if (photos.timestamps.size() < 2) {
    return false;
  }
  std::vector<std::chrono::nanoseconds> intervals;
  for (std::size_t i = 1; i < photos.timestamps.size(); ++i) {
    intervals.push_back(photos.timestamps[i] - photos.timestamps[i - 1]);
  }
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle <= kLongestVideoInterval;
}

/// Follows one video from its first frame to its last.
class VideoReader {
 public:
  VideoReader(const PhotoSet& photos, KeyframeSelector selector, const StageContext& context)
      : photos_(photos),
        selector_(std::move(selector)),
        context_(context),
        decisions_(photos.names.size()),
        is_kept_(photos.names.size(), false) {}

  Result<> read_all() {
    StageProgress progress(context_, Stage::kSelectFrames, photos_.names.size());
    std::vector<cv::Mat> batch(kBatch);
    for (std::size_t first = 0; first < photos_.names.size(); first += kBatch) {
      if (context_.stop.stop_requested()) {
        return fail(ErrorCode::kCancelled, "stopped while choosing the frames of the video");
      }
      const std::size_t count = std::min(kBatch, photos_.names.size() - first);
      context_.executor.for_each_index(count, [&](std::size_t i) {
        batch[i] = decode(first + i);
        progress.advance();
      });
      for (std::size_t i = 0; i < count; ++i) {
        look_at(first + i, batch[i]);
      }
    }
    take(selector_.finish());
    return {};
  }

  [[nodiscard]] PhotoSet chosen() const {
    std::vector<VideoFrameSection> frames;
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < photos_.names.size(); ++i) {
      if (is_kept_[i]) {
        kept.push_back(i);
      }
      if (decisions_[i]) {
        const std::chrono::duration<double> time = photos_.timestamps[i] - photos_.timestamps[0];
        frames.push_back(
            {photos_.names[i], time.count(), decisions_[i]->verdict, decisions_[i]->measures});
      }
    }
    PhotoSet result = subset(photos_, kept);
    result.is_walk = true;
    result.frames = std::move(frames);
    result.description = fmt::format(
        "{}, {} of {} frames kept", photos_.description, kept.size(), photos_.names.size());
    return result;
  }

 private:
  [[nodiscard]] cv::Mat decode(std::size_t frame) const {
    const auto file = photos_.read(frame);
    auto decoded = file ? decode_image(*file, {.channels = ImageChannels::kGrey})
                        : Result<DecodedImage>(tl::unexpected(file.error()));
    return decoded ? decoded->grey : cv::Mat();
  }

  void look_at(std::size_t frame, const cv::Mat& grey) {
    if (grey.empty() || (!size_.empty() && grey.size() != size_)) {
      is_kept_[frame] = true;
      return;
    }
    size_ = grey.size();
    take(selector_.offer({frame, photos_.timestamps[frame], grey}));
  }

  void take(std::span<const FrameDecision> decisions) {
    for (const FrameDecision& decision : decisions) {
      is_kept_[decision.id] = decision.verdict == FrameVerdict::kKept;
      decisions_[decision.id] = decision;
    }
  }

  const PhotoSet& photos_;
  KeyframeSelector selector_;
  const StageContext& context_;
  cv::Size size_;
  std::vector<std::optional<FrameDecision>> decisions_;
  std::vector<bool> is_kept_;
};

}  // namespace

std::string_view to_string(FrameUse use) {
  switch (use) {
    case FrameUse::kAuto:
      return "auto";
    case FrameUse::kAll:
      return "all";
    case FrameUse::kKeyframes:
      return "keyframes";
    case FrameUse::kWalk:
      break;
  }
  return "walk";
}

std::optional<FrameUse> frame_use_from_string(std::string_view name) {
  return named_value(kFrameUses, name);
}

Result<bool> wants_keyframes(const PhotoSet& photos, FrameUse use) {
  if (use == FrameUse::kKeyframes && photos.timestamps.empty()) {
    return fail(
        ErrorCode::kInvalidArgument,
        "keyframes can only be chosen from a video or a recording whose timestamps.csv says "
        "when each frame was taken; {} has no times",
        photos.description);
  }
  return use == FrameUse::kKeyframes || (use == FrameUse::kAuto && is_video(photos));
}

Result<PhotoSet> choose_keyframes(const PhotoSet& photos,
                                  const KeyframeOptions& options,
                                  const StageContext& context) {
  TM_CHECK(photos.timestamps.size() == photos.names.size());
  TM_ASSIGN_OR_RETURN(KeyframeSelector selector, KeyframeSelector::create(options));
  VideoReader reader(photos, std::move(selector), context);
  TM_RETURN_IF_ERROR(reader.read_all());
  PhotoSet chosen = reader.chosen();
  if (chosen.names.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "none of the {} frames of the video is worth keeping; the first: {}. Use all "
                "frames to try them nevertheless",
                photos.names.size(),
                to_string(chosen.frames.front().verdict));
  }
  return chosen;
}

}  // namespace trigmesh
