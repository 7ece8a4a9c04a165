#include "sfm/features/sift_scale_space.hpp"

#include <algorithm>
#include <tuple>

#include "firmware/base/check.hpp"
#include "sfm/features/sift_strip.hpp"

namespace trigmesh::sift {
namespace {

constexpr double kInputSigma =
    0.5;  ///< blur that the camera's pixels are taken to have, input pixels
constexpr int kMinOctaveSide = 16;
constexpr int kStripWidth =
    768;  ///< strips of about this width have their rows in the second-level cache
constexpr int kStripStep = 32;

void read_row(const cv::Mat& grey, int y, int x, int count, float* out) {
  const std::uint8_t* row = grey.ptr<std::uint8_t>(y) + x;
  for (int i = 0; i < count; ++i) {
    out[i] = static_cast<float>(row[i]);
  }
}

/// Pixel (x, y) of the doubled image lies at (x / 2, y / 2) of the input: even pixels are copies,
/// odd ones means.
void read_doubled_row(const cv::Mat& grey, int y, int x, int count, float* out) {
  const std::uint8_t* upper = grey.ptr<std::uint8_t>(y / 2);
  const std::uint8_t* lower = grey.ptr<std::uint8_t>((y + 1) / 2);
  for (int i = 0; i < count; ++i) {
    const int left = (x + i) / 2;
    const int right = (x + i + 1) / 2;
    out[i] = 0.25F * static_cast<float>(upper[left] + upper[right] + lower[left] + lower[right]);
  }
}

auto key(const Extremum& e) {
  return std::tuple(e.octave, e.level, e.y_px, e.x_px, e.sigma_px, e.response);
}

void work_through(const OctaveKernels& kernels,
                  const OctaveJob& job,
                  const ScaleSpaceOptions& options,
                  std::vector<float>& memory,
                  std::vector<Extremum>& extrema) {
  const int width = job.octave->width;
  const int strips = (width + kStripWidth - 1) / kStripWidth;
  const int step = ((width + strips - 1) / strips + kStripStep - 1) / kStripStep * kStripStep;
  StripPass pass(kernels, job, options, memory);
  for (int begin = 0; begin < width; begin += step) {
    pass.run(begin, std::min(begin + step, width), extrema);
  }
}

}  // namespace

void ScaleSpace::build(const cv::Mat& grey, const ScaleSpaceOptions& options) {
  static const OctaveKernels kernels;
  static const GaussianKernel plain_to_base = OctaveKernels::to_base(kInputSigma);
  static const GaussianKernel doubled_to_base = OctaveKernels::to_base(2.0 * kInputSigma);
  const bool is_doubled = options.first_octave == FirstOctave::kDoubleSize;
  int width = is_doubled ? 2 * grey.cols - 1 : grey.cols;
  int height = is_doubled ? 2 * grey.rows - 1 : grey.rows;
  float pixel_size_px = is_doubled ? 0.5F : 1.0F;
  extrema_.clear();
  octave_count_ = 0;
  while (std::min(width, height) >= kMinOctaveSide) {
    const auto index = static_cast<std::size_t>(octave_count_);
    if (octaves_.size() <= index) {
      octaves_.emplace_back();
    }
    Octave& octave = octaves_[index];
    octave.width = width;
    octave.height = height;
    octave.pixel_size_px = pixel_size_px;
    for (auto& level : octave.levels) {
      level.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    }
    const int next_width = (width + 1) / 2;
    const int next_height = (height + 1) / 2;
    std::vector<float>& next_base = bases_[index % 2];
    next_base.resize(static_cast<std::size_t>(next_width) * static_cast<std::size_t>(next_height));
    const std::vector<float>& base = bases_[1 - index % 2];
    OctaveJob job{.index = octave_count_,
                  .source = nullptr,
                  .to_base = nullptr,
                  .octave = &octave,
                  .next_base = next_base.data(),
                  .next_width = next_width};
    if (octave_count_ > 0) {
      job.source = [&base, width](int y, int x, int count, float* out) {
        std::copy_n(base.data() + std::ptrdiff_t{y} * width + x, count, out);
      };
    } else {
      job.to_base = is_doubled ? &doubled_to_base : &plain_to_base;
      job.source = [&grey, is_doubled](int y, int x, int count, float* out) {
        (is_doubled ? read_doubled_row : read_row)(grey, y, x, count, out);
      };
    }
    work_through(kernels, job, options, strip_memory_, extrema_);
    ++octave_count_;
    width = next_width;
    height = next_height;
    pixel_size_px *= 2.0F;
  }
  // Two starts may have walked to the same extremum.
  std::sort(extrema_.begin(), extrema_.end(), [](const Extremum& a, const Extremum& b) {
    return key(a) < key(b);
  });
  const auto same = [](const Extremum& a, const Extremum& b) { return key(a) == key(b); };
  extrema_.erase(std::unique(extrema_.begin(), extrema_.end(), same), extrema_.end());
}

const Octave& ScaleSpace::octave(int index) const {
  TM_CHECK(index >= 0 && index < octave_count_);
  return octaves_[static_cast<std::size_t>(index)];
}

LevelView ScaleSpace::level(int octave_index, int level_index) const {
  TM_CHECK(level_index >= 1 && level_index <= kScalesPerOctave);
  const Octave& from = octave(octave_index);
  return {.pixels = from.levels[static_cast<std::size_t>(level_index - 1)].data(),
          .width = from.width,
          .height = from.height,
          .stride = from.width};
}

}  // namespace trigmesh::sift
