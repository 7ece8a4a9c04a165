#include "sfm/features/sift_rows.hpp"

#include <cmath>
#include <cstddef>

// The file is compiled once for each instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sfm/features/sift_rows.cpp"
// SVE vectors cannot be members; such machines run the NEON code.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace trigmesh::sift::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using FloatTag = hn::ScalableTag<float>;

void BlurColumns(const GaussianKernel& kernel,
                 const float* const* rows,
                 int width,
                 const std::array<float*, kRowsAtOnce>& out) {
  static_assert(kRowsAtOnce == 4);
  const FloatTag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const int row_count = 2 * kernel.radius + kRowsAtOnce;
  const float* weight = kernel.padded.data();
  for (int x = 0; x < width; x += 2 * lanes) {
    auto a0 = hn::Zero(d), a1 = hn::Zero(d), a2 = hn::Zero(d), a3 = hn::Zero(d);
    auto b0 = hn::Zero(d), b1 = hn::Zero(d), b2 = hn::Zero(d), b3 = hn::Zero(d);
    for (int t = 0; t < row_count; ++t) {
      const auto a = hn::LoadU(d, rows[t] + x);
      const auto b = hn::LoadU(d, rows[t] + x + lanes);
      const auto w0 = hn::Set(d, weight[t + 3]);
      const auto w1 = hn::Set(d, weight[t + 2]);
      const auto w2 = hn::Set(d, weight[t + 1]);
      const auto w3 = hn::Set(d, weight[t]);
      a0 = hn::MulAdd(w0, a, a0);
      b0 = hn::MulAdd(w0, b, b0);
      a1 = hn::MulAdd(w1, a, a1);
      b1 = hn::MulAdd(w1, b, b1);
      a2 = hn::MulAdd(w2, a, a2);
      b2 = hn::MulAdd(w2, b, b2);
      a3 = hn::MulAdd(w3, a, a3);
      b3 = hn::MulAdd(w3, b, b3);
    }
    hn::StoreU(a0, d, out[0] + x);
    hn::StoreU(b0, d, out[0] + x + lanes);
    hn::StoreU(a1, d, out[1] + x);
    hn::StoreU(b1, d, out[1] + x + lanes);
    hn::StoreU(a2, d, out[2] + x);
    hn::StoreU(b2, d, out[2] + x + lanes);
    hn::StoreU(a3, d, out[3] + x);
    hn::StoreU(b3, d, out[3] + x + lanes);
  }
}

template <class Store>
HWY_INLINE void BlurRowWith(const GaussianKernel& kernel,
                            const float* row,
                            int width,
                            const Store& store) {
  const FloatTag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const float* half = kernel.half.data();
  for (int x = 0; x < width; x += lanes) {
    auto sum = hn::Mul(hn::Set(d, half[0]), hn::LoadU(d, row + x));
    for (int i = 1; i <= kernel.radius; ++i) {
      const auto pair = hn::Add(hn::LoadU(d, row + x - i), hn::LoadU(d, row + x + i));
      sum = hn::MulAdd(hn::Set(d, half[i]), pair, sum);
    }
    store(x, sum);
  }
}

void BlurRow(const GaussianKernel& kernel,
             const float* row,
             int width,
             float* blurred,
             const float* finer,
             float* difference) {
  const FloatTag d;
  if (difference == nullptr) {
    BlurRowWith(kernel, row, width, [&](int x, auto sum) { hn::StoreU(sum, d, blurred + x); });
    return;
  }
  BlurRowWith(kernel, row, width, [&](int x, auto sum) {
    hn::StoreU(hn::Sub(sum, hn::LoadU(d, finer + x)), d, difference + x);
    hn::StoreU(sum, d, blurred + x);
  });
}

void QuantiseRow(const float* row, int width, std::uint16_t* out) {
  const FloatTag d;
  const hn::Rebind<std::uint16_t, FloatTag> d16;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto scale = hn::Set(d, 256.0F);
  int x = 0;
  for (; x + lanes <= width; x += lanes) {
    const auto fixed = hn::NearestInt(hn::Mul(scale, hn::LoadU(d, row + x)));
    hn::StoreU(hn::DemoteTo(d16, fixed), d16, out + x);
  }
  for (; x < width; ++x) {
    out[x] = static_cast<std::uint16_t>(std::lrintf(256.0F * row[x]));
  }
}

template <class V>
struct Range {
  V low;
  V high;
};

HWY_INLINE Range<hn::Vec<FloatTag>> RangeOfThree(FloatTag d, const float* p) {
  const auto a = hn::LoadU(d, p - 1);
  const auto b = hn::LoadU(d, p);
  const auto c = hn::LoadU(d, p + 1);
  return {hn::Min(hn::Min(a, c), b), hn::Max(hn::Max(a, c), b)};
}

template <class V>
HWY_INLINE Range<V> Join(const Range<V>& a, const Range<V>& b) {
  return {hn::Min(a.low, b.low), hn::Max(a.high, b.high)};
}

// Ties: neighbours that come before in (layer, y, x) may equal the centre, those behind may not.
void FindExtrema(
    const Neighbourhood& rows, float threshold, int begin, int end, std::vector<int>& out) {
  const FloatTag d;
  const hn::RebindToSigned<FloatTag> di;
  using V = hn::Vec<FloatTag>;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto& [finer, centre, coarser] = rows;
  alignas(64) std::int32_t found[HWY_MAX_BYTES / sizeof(std::int32_t)];
  for (int x = begin; x < end; x += lanes) {
    const V v = hn::LoadU(d, centre[1] + x);
    const auto strong = hn::Gt(hn::Abs(v), hn::Set(d, threshold));
    if (hn::AllFalse(d, strong)) {
      continue;
    }
    const V left = hn::LoadU(d, centre[1] + x - 1);
    const V right = hn::LoadU(d, centre[1] + x + 1);
    const auto before = Join(RangeOfThree(d, centre[0] + x), Range<V>{left, left});
    const auto behind = Join(RangeOfThree(d, centre[2] + x), Range<V>{right, right});
    const auto top = hn::And(hn::Ge(v, before.high), hn::Gt(v, behind.high));
    const auto bottom = hn::And(hn::Le(v, before.low), hn::Lt(v, behind.low));
    if (hn::AllFalse(d, hn::And(strong, hn::Or(top, bottom)))) {
      continue;
    }
    const auto below = Join(Join(RangeOfThree(d, finer[0] + x), RangeOfThree(d, finer[1] + x)),
                            RangeOfThree(d, finer[2] + x));
    const auto above = Join(Join(RangeOfThree(d, coarser[0] + x), RangeOfThree(d, coarser[1] + x)),
                            RangeOfThree(d, coarser[2] + x));
    const auto highest = hn::And(top, hn::And(hn::Ge(v, below.high), hn::Gt(v, above.high)));
    const auto lowest = hn::And(bottom, hn::And(hn::Le(v, below.low), hn::Lt(v, above.low)));
    const auto chosen = hn::And(strong, hn::Or(highest, lowest));
    if (hn::AllFalse(d, chosen)) {
      continue;
    }
    const std::size_t count =
        hn::CompressStore(hn::Iota(di, x), hn::RebindMask(di, chosen), di, found);
    for (std::size_t i = 0; i < count && found[i] < end; ++i) {
      out.push_back(found[i]);
    }
  }
}

}  // namespace
}  // namespace trigmesh::sift::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trigmesh::sift {
namespace {

constexpr double kTruncationSigmas = 3.5;

HWY_EXPORT(BlurColumns);
HWY_EXPORT(BlurRow);
HWY_EXPORT(QuantiseRow);
HWY_EXPORT(FindExtrema);

std::vector<double> sampled_gaussian(double sigma, int radius) {
  std::vector<double> half;
  double sum = 0.0;
  for (int i = 0; i <= radius; ++i) {
    half.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += i == 0 ? half.back() : 2.0 * half.back();
  }
  for (double& weight : half) {
    weight /= sum;
  }
  return half;
}

double variance(const std::vector<double>& half) {
  double sum = 0.0;
  for (std::size_t i = 1; i < half.size(); ++i) {
    sum += 2.0 * static_cast<double>(i * i) * half[i];
  }
  return sum;
}

}  // namespace

GaussianKernel make_gaussian_kernel(double sigma) {
  GaussianKernel kernel;
  kernel.radius = static_cast<int>(std::ceil(kTruncationSigmas * sigma));
  double fitted_sigma = sigma;
  std::vector<double> half = sampled_gaussian(fitted_sigma, kernel.radius);
  for (int iteration = 0; iteration < 20; ++iteration) {  // truncation narrows: widen until it fits
    fitted_sigma *= sigma / std::sqrt(variance(half));
    half = sampled_gaussian(fitted_sigma, kernel.radius);
  }
  kernel.half.assign(half.begin(), half.end());
  kernel.padded.assign(kRowsAtOnce - 1, 0.0F);
  kernel.padded.insert(kernel.padded.end(), kernel.half.rbegin(), kernel.half.rend());
  kernel.padded.insert(kernel.padded.end(), kernel.half.begin() + 1, kernel.half.end());
  kernel.padded.insert(kernel.padded.end(), kRowsAtOnce - 1, 0.0F);
  return kernel;
}

void blur_columns(const GaussianKernel& kernel,
                  const float* const* rows,
                  int width,
                  const std::array<float*, kRowsAtOnce>& out) {
  HWY_DYNAMIC_DISPATCH(BlurColumns)(kernel, rows, width, out);
}

void blur_row(const GaussianKernel& kernel,
              const float* row,
              int width,
              float* blurred,
              const float* finer,
              float* difference) {
  HWY_DYNAMIC_DISPATCH(BlurRow)(kernel, row, width, blurred, finer, difference);
}

void quantise_row(const float* row, int width, std::uint16_t* out) {
  HWY_DYNAMIC_DISPATCH(QuantiseRow)(row, width, out);
}

void find_extrema(
    const Neighbourhood& rows, float threshold, int begin, int end, std::vector<int>& out) {
  HWY_DYNAMIC_DISPATCH(FindExtrema)(rows, threshold, begin, end, out);
}

}  // namespace trigmesh::sift
#endif  // HWY_ONCE
