#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "firmware/base/check.hpp"
#include "sfm/features/extractors.hpp"
#include "sfm/features/keypoint_spread.hpp"
#include "sfm/features/sift_describe.hpp"
#include "sfm/features/sift_scale_space.hpp"

namespace trigmesh {
namespace {

using sift::Extremum;
using sift::ScaleSpace;

/// A keypoint to be described, and the extremum it comes from.
struct Oriented {
  std::size_t extremum = 0;
  Keypoint keypoint;
};

sift::PatchCentre centre_of(const Extremum& extremum) {
  return {.x_px = extremum.x_px, .y_px = extremum.y_px, .sigma_px = extremum.sigma_px};
}

Keypoint to_keypoint(const Extremum& extremum, float pixel_size_px, float angle_rad) {
  return {.x_px = extremum.x_px * pixel_size_px,
          .y_px = extremum.y_px * pixel_size_px,
          .scale_px = extremum.sigma_px * pixel_size_px,
          .angle_rad = angle_rad,
          .response = extremum.response};
}

/// Our own SIFT. Thread-safe: each call takes a work space from a shelf, or makes one.
class Sift final : public FeatureExtractor {
 public:
  explicit Sift(const FeatureOptions& options) : options_(options) {
    if (options.upsample) {
      scale_space_options_.first_octave = sift::FirstOctave::kDoubleSize;
    }
  }

  Result<FeatureSet> extract(const cv::Mat& grey) const override {
    TM_RETURN_IF_ERROR(check_grey_image(grey));
    std::unique_ptr<ScaleSpace> space = take_work_space();
    space->build(grey, scale_space_options_);
    FeatureSet features = describe(*space, orient(*space, select(*space, grey)));
    give_back(std::move(space));
    return features;
  }

 private:
  /// Indices of the extrema to keep, most wanted first.
  std::vector<std::size_t> select(const ScaleSpace& space, const cv::Mat& grey) const {
    std::vector<SpreadCandidate> candidates;
    candidates.reserve(space.extrema().size());
    for (const Extremum& extremum : space.extrema()) {
      const float pixel_size_px = space.octave(extremum.octave).pixel_size_px;
      candidates.push_back({.x_px = extremum.x_px * pixel_size_px,
                            .y_px = extremum.y_px * pixel_size_px,
                            .strength = extremum.response});
    }
    return spread_keypoints(
        candidates, grey.cols, grey.rows, static_cast<std::size_t>(options_.max_keypoints));
  }

  /// One or two keypoints for each chosen extremum until the budget is used up.
  std::vector<Oriented> orient(const ScaleSpace& space,
                               const std::vector<std::size_t>& chosen) const {
    const auto budget = static_cast<std::size_t>(options_.max_keypoints);
    std::vector<Oriented> oriented;
    oriented.reserve(budget + 1);
    for (const std::size_t index : chosen) {
      const Extremum& extremum = space.extrema()[index];
      const float pixel_size_px = space.octave(extremum.octave).pixel_size_px;
      sift::Orientations found{.angle_rad = {}, .count = 1};
      if (options_.oriented) {
        found = sift::find_orientations(space.level(extremum.octave, extremum.level),
                                        centre_of(extremum));
      }
      for (int i = 0; i < found.count && oriented.size() < budget; ++i) {
        const float angle_rad = found.angle_rad[static_cast<std::size_t>(i)];
        oriented.push_back({index, to_keypoint(extremum, pixel_size_px, angle_rad)});
      }
    }
    return oriented;
  }

  /// Describes in order of memory, writes in the order that is promised to callers.
  static FeatureSet describe(const ScaleSpace& space, std::vector<Oriented> oriented) {
    std::sort(oriented.begin(), oriented.end(), [](const Oriented& a, const Oriented& b) {
      return comes_before(a.keypoint, b.keypoint);
    });
    FeatureSet features{.kind = FeatureKind::kSift,
                        .keypoints = {},
                        .descriptor_bytes = sift::kDescriptorLength,
                        .descriptors = {}};
    features.descriptors.resize(oriented.size() * sift::kDescriptorLength);
    std::vector<std::size_t> memory_order(oriented.size());
    std::iota(memory_order.begin(), memory_order.end(), std::size_t{0});
    std::sort(memory_order.begin(), memory_order.end(), [&](std::size_t a, std::size_t b) {
      return std::pair(oriented[a].extremum, a) < std::pair(oriented[b].extremum, b);
    });
    for (const std::size_t row : memory_order) {
      const Extremum& extremum = space.extrema()[oriented[row].extremum];
      std::uint8_t* out = features.descriptors.data() + row * sift::kDescriptorLength;
      sift::describe(
          space.level(extremum.octave, extremum.level),
          centre_of(extremum),
          oriented[row].keypoint.angle_rad,
          std::span<std::uint8_t, sift::kDescriptorLength>(out, sift::kDescriptorLength));
    }
    for (const Oriented& point : oriented) {
      features.keypoints.push_back(point.keypoint);
    }
    return features;
  }

  std::unique_ptr<ScaleSpace> take_work_space() const {
    const std::scoped_lock lock(mutex_);
    if (shelf_.empty()) {
      return std::make_unique<ScaleSpace>();
    }
    std::unique_ptr<ScaleSpace> space = std::move(shelf_.back());
    shelf_.pop_back();
    return space;
  }

  void give_back(std::unique_ptr<ScaleSpace> space) const {
    const std::scoped_lock lock(mutex_);
    shelf_.push_back(std::move(space));
  }

  FeatureOptions options_;
  sift::ScaleSpaceOptions scale_space_options_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<ScaleSpace>> shelf_;  ///< work spaces not in use
};

}  // namespace

FeatureExtractorResult create_sift_extractor(const FeatureOptions& options) {
  return std::make_unique<Sift>(options);
}

}  // namespace trigmesh
