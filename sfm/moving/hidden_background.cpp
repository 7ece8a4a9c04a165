// Free-space reasoning on depth maps as in P. Merrell et al., "Real-time visibility-based fusion of
// depth maps", ICCV 2007, turned round: not which depth is contradicted, but which picture.
#include "sfm/moving/hidden_background.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>
#include <opencv2/core.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

// Views at most that are asked about a pixel.
constexpr std::size_t kMaxWitnesses = 12;
// A pose or a map that is off by a pixel shows the colour of the pixel beside it.
constexpr int kSlackPx = 1;
// Exposure is not judged from fewer pixels.
constexpr std::size_t kMinExposurePixels = 200;
// Nearer than this part of the nearest depth of the scene nothing is asked for.
constexpr float kNearestRatio = 0.7F;

using Color = std::array<float, 3>;

Color color_at(const cv::Mat& rgb, int x, int y) {
  const auto& p = rgb.at<cv::Vec3b>(y, x);
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

bool is_inside(const cv::Mat& image, float x, float y) {
  return x >= 0.0F && y >= 0.0F && x < static_cast<float>(image.cols) &&
         y < static_cast<float>(image.rows);
}

/// From pixels and depths of one view to pixels of another: other ~ rotation p z + epipole.
struct PixelMotion {
  Eigen::Matrix3f rotation;
  Eigen::Vector3f epipole;

  PixelMotion(const MovingView& from, const MovingView& to) {
    const Rigid3 motion = to.cam_from_world * from.cam_from_world.inverse();
    const Eigen::Matrix3d k_to = to.camera.calibration_matrix();
    rotation =
        (k_to * motion.rotation.toRotationMatrix() * from.camera.calibration_matrix().inverse())
            .cast<float>();
    epipole = (k_to * motion.translation).cast<float>();
  }

  /// Homogeneous: (u z, v z, z).
  [[nodiscard]] Eigen::Vector3f operator()(int x, int y, float depth) const {
    return rotation * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 1.0F) * depth +
           epipole;
  }
};

/// What one neighbour shows of the scene, as seen from the view.
struct Witness {
  const MovingView* view = nullptr;
  PixelMotion from_view;  ///< from pixels of the view to those of the neighbour
  cv::Mat depth;          ///< CV_32FC1 in the view, 0 = nothing
  cv::Mat rgb;            ///< CV_8UC3
};

Witness make_witness(const MovingView& view, const MovingView& neighbor) {
  Witness witness{&neighbor, PixelMotion(view, neighbor), {}, {}};
  witness.depth = cv::Mat(view.rgb.size(), CV_32FC1, cv::Scalar(0));
  witness.rgb = cv::Mat(view.rgb.size(), CV_8UC3, cv::Scalar(0, 0, 0));
  const PixelMotion to_view(neighbor, view);
  for (int y = 0; y < neighbor.depth.rows; ++y) {
    for (int x = 0; x < neighbor.depth.cols; ++x) {
      const float depth = neighbor.depth.at<float>(y, x);
      if (!(depth > 0.0F)) {
        continue;
      }
      const Eigen::Vector3f there = to_view(x, y, depth);
      const float u = std::round(there.x() / there.z());
      const float v = std::round(there.y() / there.z());
      if (!(there.z() > 0.0F && is_inside(witness.depth, u, v))) {
        continue;
      }
      float& nearest = witness.depth.at<float>(static_cast<int>(v), static_cast<int>(u));
      if (nearest == 0.0F || there.z() < nearest) {
        nearest = there.z();
        witness.rgb.at<cv::Vec3b>(static_cast<int>(v), static_cast<int>(u)) =
            neighbor.rgb.at<cv::Vec3b>(y, x);
      }
    }
  }
  return witness;
}

std::vector<Witness> make_witnesses(std::span<const MovingView> views, std::size_t view) {
  std::vector<Witness> witnesses;
  for (const std::size_t n : views[view].neighbors) {
    if (witnesses.size() < kMaxWitnesses && !views[n].depth.empty()) {
      witnesses.push_back(make_witness(views[view], views[n]));
    }
  }
  return witnesses;
}

/// The surface that the scene has behind a pixel.
struct Background {
  float depth = 0.0F;
  Color color{};
  Color spread{};  ///< median distance of the witnesses' colours from `color`
};

float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The nearest surface that enough witnesses agree on.
std::optional<Background> background_at(std::span<const Witness> witnesses,
                                        int x,
                                        int y,
                                        const HiddenBackgroundOptions& options) {
  struct Sight {
    float depth;
    const Witness* witness;
  };

  std::vector<Sight> sights;
  for (const Witness& witness : witnesses) {
    if (const float depth = witness.depth.at<float>(y, x); depth > 0.0F) {
      sights.push_back({depth, &witness});
    }
  }
  std::stable_sort(sights.begin(), sights.end(), [](const Sight& a, const Sight& b) {
    return a.depth < b.depth;
  });
  for (std::size_t first = 0; first + options.min_witnesses <= sights.size(); ++first) {
    std::size_t end = first + 1;
    while (end < sights.size() &&
           sights[end].depth <= sights[first].depth * (1.0F + options.max_depth_ratio)) {
      ++end;
    }
    if (end - first < options.min_witnesses) {
      continue;
    }
    Background background;
    background.depth = sights[first].depth;
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<float> values;
      for (std::size_t i = first; i < end; ++i) {
        values.push_back(color_at(sights[i].witness->rgb, x, y)[c]);
      }
      background.color[c] = median(values);
      for (float& value : values) {
        value = std::abs(value - background.color[c]);
      }
      background.spread[c] = median(values);
    }
    return background;
  }
  return std::nullopt;
}

/// All backgrounds of a view; depth 0 where nothing is known.
struct BackgroundPicture {
  cv::Mat depth;   ///< CV_32FC1
  cv::Mat color;   ///< CV_32FC3
  cv::Mat spread;  ///< CV_32FC3
};

cv::Vec3f to_pixel(const Color& color) {
  return {color[0], color[1], color[2]};
}

BackgroundPicture render_background(const MovingView& view,
                                    std::span<const Witness> witnesses,
                                    const HiddenBackgroundOptions& options) {
  BackgroundPicture picture{cv::Mat(view.rgb.size(), CV_32FC1, cv::Scalar(0)),
                            cv::Mat(view.rgb.size(), CV_32FC3, cv::Scalar(0, 0, 0)),
                            cv::Mat(view.rgb.size(), CV_32FC3, cv::Scalar(0, 0, 0))};
  for (int y = 0; y < view.rgb.rows; ++y) {
    for (int x = 0; x < view.rgb.cols; ++x) {
      if (const auto background = background_at(witnesses, x, y, options)) {
        picture.depth.at<float>(y, x) = background->depth;
        picture.color.at<cv::Vec3f>(y, x) = to_pixel(background->color);
        picture.spread.at<cv::Vec3f>(y, x) = to_pixel(background->spread);
      }
    }
  }
  return picture;
}

/// Factor for each channel that brings the background to the exposure of the view: the median over
/// the pixels whose own depth says that they show it.
Color exposure_of(const MovingView& view,
                  const BackgroundPicture& background,
                  const HiddenBackgroundOptions& options) {
  std::array<std::vector<float>, 3> ratios;
  for (int y = 0; y < view.depth.rows; ++y) {
    for (int x = 0; x < view.depth.cols; ++x) {
      const float own = view.depth.at<float>(y, x);
      const float behind = background.depth.at<float>(y, x);
      if (!(own > 0.0F && behind > 0.0F &&
            std::abs(own - behind) <= options.max_depth_ratio * own)) {
        continue;
      }
      const Color color = color_at(view.rgb, x, y);
      const auto& expected = background.color.at<cv::Vec3f>(y, x);
      for (std::size_t c = 0; c < 3; ++c) {
        ratios[c].push_back((color[c] + 1.0F) / (expected[static_cast<int>(c)] + 1.0F));
      }
    }
  }
  Color gain{1.0F, 1.0F, 1.0F};
  for (std::size_t c = 0; c < 3 && ratios[c].size() >= kMinExposurePixels; ++c) {
    gain[c] = median(ratios[c]);
  }
  return gain;
}

/// Whether a colour of the view differs from all of the background around the pixel.
bool differs(const MovingView& view,
             const BackgroundPicture& background,
             const Color& gain,
             cv::Point at,
             const HiddenBackgroundOptions& options) {
  const Color color = color_at(view.rgb, at.x, at.y);
  for (int y = std::max(0, at.y - kSlackPx); y <= std::min(view.rgb.rows - 1, at.y + kSlackPx);
       ++y) {
    for (int x = std::max(0, at.x - kSlackPx); x <= std::min(view.rgb.cols - 1, at.x + kSlackPx);
         ++x) {
      if (!(background.depth.at<float>(y, x) > 0.0F)) {
        continue;
      }
      bool same = true;
      for (int c = 0; c < 3; ++c) {
        const auto channel = static_cast<std::size_t>(c);
        const float expected = background.color.at<cv::Vec3f>(y, x)[c] * gain[channel];
        const float allowed =
            std::max(options.min_color_difference,
                     options.min_spread_ratio * background.spread.at<cv::Vec3f>(y, x)[c]);
        same = same && std::abs(color[channel] - std::min(expected, 255.0F)) <= allowed;
      }
      if (same) {
        return false;
      }
    }
  }
  return true;
}

/// Whether everything between the camera and the background was seen to be empty.
bool is_empty_in_front(const MovingView& view,
                       std::span<const Witness> witnesses,
                       cv::Point at,
                       float background_depth,
                       const HiddenBackgroundOptions& options) {
  const float far = 1.0F / (background_depth * (1.0F - 2.0F * options.max_depth_ratio));
  const float near = 1.0F / std::max(kNearestRatio * view.min_depth, 0.05F * background_depth);
  for (int s = 0; s < options.samples && near > far; ++s) {
    const float part = (static_cast<float>(s) + 0.5F) / static_cast<float>(options.samples);
    const float depth = 1.0F / (far + (near - far) * part);
    std::size_t looking_through = 0;
    for (const Witness& witness : witnesses) {
      const Eigen::Vector3f there = witness.from_view(at.x, at.y, depth);
      const float u = std::round(there.x() / there.z());
      const float v = std::round(there.y() / there.z());
      if (there.z() > 0.0F && is_inside(witness.view->depth, u, v)) {
        const float seen = witness.view->depth.at<float>(static_cast<int>(v), static_cast<int>(u));
        looking_through += seen > there.z() * (1.0F + options.max_depth_ratio) ? 1U : 0U;
      }
    }
    if (looking_through < options.min_witnesses) {
      return false;
    }
  }
  return true;
}

}  // namespace

Result<> HiddenBackgroundOptions::validate() const {
  if (min_witnesses < 2) {
    return fail(ErrorCode::kInvalidArgument, "min_witnesses is {}, not >= 2", min_witnesses);
  }
  if (!(max_depth_ratio > 0.0F && max_depth_ratio <= 0.5F)) {
    return fail(
        ErrorCode::kInvalidArgument, "max_depth_ratio is {}, not in (0, 0.5]", max_depth_ratio);
  }
  if (!(min_color_difference >= 0.0F && min_color_difference <= 255.0F)) {
    return fail(ErrorCode::kInvalidArgument,
                "min_color_difference is {}, not in [0, 255]",
                min_color_difference);
  }
  if (!(min_spread_ratio >= 0.0F)) {
    return fail(ErrorCode::kInvalidArgument, "min_spread_ratio is {}, not >= 0", min_spread_ratio);
  }
  if (samples < 1) {
    return fail(ErrorCode::kInvalidArgument, "samples is {}, not >= 1", samples);
  }
  return {};
}

cv::Mat find_hidden_background(std::span<const MovingView> views,
                               std::size_t view,
                               const HiddenBackgroundOptions& options) {
  TM_CHECK(view < views.size());
  const MovingView& own = views[view];
  cv::Mat hidden(own.rgb.size(), CV_8UC1, cv::Scalar(0));
  const std::vector<Witness> witnesses = make_witnesses(views, view);
  if (witnesses.size() < options.min_witnesses || own.depth.empty()) {
    return hidden;
  }
  const BackgroundPicture background = render_background(own, witnesses, options);
  const Color gain = exposure_of(own, background, options);
  for (int y = 0; y < hidden.rows; ++y) {
    for (int x = 0; x < hidden.cols; ++x) {
      const float behind = background.depth.at<float>(y, x);
      const bool left_out = !own.mask.empty() && own.mask.at<std::uint8_t>(y, x) == 0;
      if (behind > 0.0F && !left_out && !(own.depth.at<float>(y, x) > 0.0F) &&
          differs(own, background, gain, {x, y}, options) &&
          is_empty_in_front(own, witnesses, {x, y}, behind, options)) {
        hidden.at<std::uint8_t>(y, x) = 255;
      }
    }
  }
  return hidden;
}

}  // namespace trigmesh
