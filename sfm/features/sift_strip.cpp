#include "sfm/features/sift_strip.hpp"

#include <algorithm>
#include <cmath>

#include "sfm/features/sift_refine.hpp"

namespace trigmesh::sift {
namespace {

constexpr int kBorder = 5;    ///< no extrema closer to the border of an octave, pixels
constexpr int kMaxDrift = 2;  ///< samples that refinement may walk from where it started
constexpr int kReach = kMaxDrift + 1;
constexpr int kMaxSteps = 5;
constexpr float kStepThreshold =
    0.6F;  ///< walk on when the fit lies further off; above 0.5 so that it cannot swing
constexpr float kPrescreenRatio = 0.8F;        ///< of the contrast threshold, before interpolation
constexpr int kMargin = 2 * kMaxKernelRadius;  ///< floats before the first pixel of a row
constexpr int kLine = 16;                      ///< floats in a cache line

/// An odd number of cache lines: rows at a distance of 4096 bytes would fight for the same cache
/// sets.
std::ptrdiff_t padded_stride(int count) {
  const std::ptrdiff_t lines = (kMargin + count + kRowSlack + kLine - 1) / kLine;
  return (lines | 1) * kLine;
}

}  // namespace

OctaveKernels::OctaveKernels() {
  const double ratio = std::pow(2.0, 1.0 / kScalesPerOctave);
  double sigma = kBaseSigma;
  for (std::size_t i = 1; i < to_level.size(); ++i) {
    to_level[i] = make_gaussian_kernel(sigma * std::sqrt(ratio * ratio - 1.0));
    sigma *= ratio;
  }
}

GaussianKernel OctaveKernels::to_base(double input_sigma) {
  return make_gaussian_kernel(std::sqrt(kBaseSigma * kBaseSigma - input_sigma * input_sigma));
}

int StripPass::halo(const OctaveKernels& kernels, const OctaveJob& job) {
  int sum = kReach + 1 + (job.to_base != nullptr ? job.to_base->radius : 0);
  for (const GaussianKernel& kernel : kernels.to_level) {
    sum += kernel.radius;
  }
  return sum;
}

StripPass::StripPass(const OctaveKernels& kernels,
                     const OctaveJob& job,
                     const ScaleSpaceOptions& options,
                     std::vector<float>& memory)
    : kernels_(kernels),
      job_(job),
      options_(options),
      memory_(memory),
      width_(job.octave->width),
      height_(job.octave->height) {}

void StripPass::run(int begin, int end, std::vector<Extremum>& extrema) {
  const int reach = halo(kernels_, job_);
  begin_ = begin;
  end_ = end;
  left_ = std::max(0, begin - reach);
  count_ = std::min(width_, end + reach) - left_;
  extrema_ = &extrema;
  next_input_row_ = 0;
  next_row_.fill(0);
  next_search_row_ = kBorder;
  allocate();
  while (next_row_.back() < height_) {
    produce(kLevels - 1);
    search_until(next_row_.back() - 1 - kReach);
  }
  search_until(height_ - 1 - kBorder);
}

void StripPass::allocate() {
  const std::ptrdiff_t stride = padded_stride(count_);
  std::vector<RowRing*> rings;
  const auto plan = [&](RowRing& ring, int capacity) {
    ring.capacity = capacity;
    ring.stride = stride;
    rings.push_back(&ring);
  };
  plan(input_, job_.to_base != nullptr ? 2 * job_.to_base->radius + 3 * kRowsAtOnce : 1);
  int latency = 0;  // rows by which a layer runs ahead of the last one
  for (int i = kLevels - 1; i >= 0; --i) {
    const auto level = static_cast<std::size_t>(i);
    const int next_radius = i + 1 < kLevels ? kernels_.to_level[level + 1].radius : 0;
    plan(levels_[level], 2 * next_radius + 3 * kRowsAtOnce);
    if (i > 0) {
      plan(differences_[level - 1], latency + 2 * kReach + 3 * kRowsAtOnce);
      latency += kernels_.to_level[level].radius + kRowsAtOnce;
    }
  }
  std::ptrdiff_t row_count = kRowsAtOnce;
  for (const RowRing* ring : rings) {
    row_count += ring->capacity;
  }
  const auto needed = static_cast<std::size_t>(row_count * stride + kMargin + kLine);
  if (memory_.size() < needed) {
    memory_.assign(needed, 0.0F);
  }
  const auto misaligned = reinterpret_cast<std::uintptr_t>(memory_.data()) / sizeof(float) % kLine;
  float* next = memory_.data() + (kLine - misaligned) % kLine + kMargin;
  for (float*& row : columns_done_) {
    row = next;
    next += stride;
  }
  for (RowRing* ring : rings) {
    ring->data = next;
    next += ring->capacity * stride;
  }
}

void StripPass::fetch_until(RowRing& ring, int& next_row, int last_row) {
  for (; next_row <= last_row; ++next_row) {
    job_.source(next_row, left_, count_, ring.row(next_row));
  }
}

void StripPass::blur_block(const GaussianKernel& kernel, const RowRing& from, int first_row) {
  std::array<const float*, 2 * kMaxKernelRadius + kRowsAtOnce> rows{};
  for (int t = 0; t < 2 * kernel.radius + kRowsAtOnce; ++t) {
    const int y = std::clamp(first_row - kernel.radius + t, 0, height_ - 1);
    rows[static_cast<std::size_t>(t)] = from.row(y);
  }
  blur_columns(kernel, rows.data(), count_, columns_done_);
  for (float* row : columns_done_) {
    std::fill(row - kernel.radius, row, row[0]);
    std::fill(row + count_, row + count_ + kernel.radius, row[count_ - 1]);
  }
}

void StripPass::produce_base() {
  int& next = next_row_[0];
  const int last = std::min(next + kRowsAtOnce, height_) - 1;
  if (job_.to_base == nullptr) {
    fetch_until(levels_[0], next, last);
    return;
  }
  fetch_until(input_, next_input_row_, std::min(last + job_.to_base->radius, height_ - 1));
  blur_block(*job_.to_base, input_, next);
  for (std::size_t j = 0; next <= last; ++next, ++j) {
    blur_row(*job_.to_base, columns_done_[j], count_, levels_[0].row(next), nullptr, nullptr);
  }
}

void StripPass::produce(int level) {
  if (level == 0) {
    produce_base();
    return;
  }
  const auto index = static_cast<std::size_t>(level);
  const GaussianKernel& kernel = kernels_.to_level[index];
  const RowRing& finer = levels_[index - 1];
  int& next = next_row_[index];
  const int last = std::min(next + kRowsAtOnce, height_) - 1;
  while (next_row_[index - 1] <= std::min(last + kernel.radius, height_ - 1)) {
    produce(level - 1);
  }
  blur_block(kernel, finer, next);
  for (std::size_t j = 0; next <= last; ++next, ++j) {
    blur_row(kernel,
             columns_done_[j],
             count_,
             levels_[index].row(next),
             finer.row(next),
             differences_[index - 1].row(next));
    finish_row(level, next);
  }
}

void StripPass::finish_row(int level, int y) {
  if (level > kScalesPerOctave) {
    return;
  }
  Octave& octave = *job_.octave;
  const float* row = levels_[static_cast<std::size_t>(level)].row(y) + (begin_ - left_);
  const std::ptrdiff_t offset = std::ptrdiff_t{y} * width_ + begin_;
  quantise_row(
      row, end_ - begin_, octave.levels[static_cast<std::size_t>(level - 1)].data() + offset);
  if (level == kScalesPerOctave && job_.next_base != nullptr && y % 2 == 0) {
    float* out = job_.next_base + std::ptrdiff_t{y / 2} * job_.next_width;
    for (int x = begin_ + begin_ % 2; x < end_; x += 2) {
      out[x / 2] = row[x - begin_];
    }
  }
}

void StripPass::search_until(int last_row) {
  const int last = std::min(last_row, height_ - 1 - kBorder);
  for (; next_search_row_ <= last; ++next_search_row_) {
    for (int layer = 1; layer <= kScalesPerOctave; ++layer) {
      search_row(layer, next_search_row_);
    }
  }
}

Neighbourhood StripPass::neighbourhood(int layer, int y) const {
  Neighbourhood rows{};
  for (std::size_t l = 0; l < 3; ++l) {
    const RowRing& ring = differences_[static_cast<std::size_t>(layer) - 1 + l];
    for (int i = 0; i < 3; ++i) {
      rows[l][static_cast<std::size_t>(i)] = ring.row(y - 1 + i);
    }
  }
  return rows;
}

void StripPass::search_row(int layer, int y) {
  columns_.clear();
  find_extrema(neighbourhood(layer, y),
               kPrescreenRatio * options_.min_contrast,
               std::max(begin_, kBorder) - left_,
               std::min(end_, width_ - kBorder) - left_,
               columns_);
  for (const int x : columns_) {
    refine(layer, y, x);
  }
}

void StripPass::refine(int layer, int y, int x) {
  int l = layer;
  int cx = x;
  int cy = y;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Neighbourhood rows = neighbourhood(l, cy);
    Cube cube;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        std::copy_n(rows[i][j] + cx - 1, 3, cube[i][j].begin());
      }
    }
    const auto fit = fit_quadratic(cube);
    if (!fit) {
      return;
    }
    const auto is_near = [](float offset) { return std::abs(offset) <= kStepThreshold; };
    if (is_near(fit->dx) && is_near(fit->dy) && is_near(fit->dlayer)) {
      if (std::abs(fit->value) >= options_.min_contrast &&
          !is_edge(*fit, options_.max_edge_ratio)) {
        const PlanarOffset place =
            fit_in_layer(cube, fit->dlayer).value_or(PlanarOffset{fit->dx, fit->dy});
        const float exponent = (static_cast<float>(l) + fit->dlayer) / kScalesPerOctave;
        extrema_->push_back({.octave = job_.index,
                             .level = l,
                             .x_px = static_cast<float>(left_ + cx) + place.dx,
                             .y_px = static_cast<float>(cy) + place.dy,
                             .sigma_px = static_cast<float>(kBaseSigma) * std::exp2(exponent),
                             .response = std::abs(fit->value)});
      }
      return;
    }
    const auto one_step = [](float offset) {
      return std::abs(offset) <= kStepThreshold ? 0 : (offset > 0.0F ? 1 : -1);
    };
    cx += one_step(fit->dx);
    cy += one_step(fit->dy);
    l += one_step(fit->dlayer);
    const int column = left_ + cx;
    if (l < 1 || l > kScalesPerOctave || std::abs(cx - x) > kMaxDrift ||
        std::abs(cy - y) > kMaxDrift || column < kBorder || column >= width_ - kBorder ||
        cy < kBorder || cy >= height_ - kBorder) {
      return;
    }
  }
}

}  // namespace trigmesh::sift
