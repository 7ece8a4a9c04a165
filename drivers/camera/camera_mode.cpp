#include "drivers/camera/camera_mode.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <tuple>

namespace trigmesh {
namespace {

std::ptrdiff_t rank_of(PixelFormat format) {
  return std::find(std::begin(kFormatOrder), std::end(kFormatOrder), format) -
         std::begin(kFormatOrder);
}

double rate_of(const CameraMode& mode) {
  return mode.frame_interval.count() > 0 ? 1e9 / static_cast<double>(mode.frame_interval.count())
                                         : 0.0;
}

/// Smaller is better, in this order.
auto cost_of(const CameraMode& mode, const CameraWish& wish) {
  const int size =
      std::abs(mode.width_px - wish.width_px) + std::abs(mode.height_px - wish.height_px);
  const double rate = rate_of(mode);
  // A mode that does not tell its rate may reach it.
  const long short_hz = rate > 0.0 ? std::max(0L, std::lround(wish.rate_hz - rate)) : 0L;
  return std::make_tuple(size, short_hz, rank_of(mode.format), std::abs(rate - wish.rate_hz));
}

}  // namespace

bool is_better(const CameraMode& a, const CameraMode& b, const CameraWish& wish) {
  return cost_of(a, wish) < cost_of(b, wish);
}

DeviceResult<CameraMode> choose_mode(std::span<const CameraMode> modes,
                                     const CameraWish& wish,
                                     const std::string& camera) {
  const CameraMode* best = nullptr;
  std::string formats;
  for (const CameraMode& mode : modes) {
    const std::string_view name = to_string(mode.format);
    if (formats.find(name) == std::string::npos) {
      formats += fmt::format("{}{}", formats.empty() ? "" : ", ", name);
    }
    const bool is_wished = !wish.format || *wish.format == mode.format;
    if (is_wished && (best == nullptr || is_better(mode, *best, wish))) {
      best = &mode;
    }
  }
  if (best == nullptr) {
    return device_fault(FaultKind::kFormatRefused,
                        "camera {} does not deliver {}; formats that it has and we read: {}",
                        camera,
                        wish.format ? to_string(*wish.format) : "any format that we read",
                        formats.empty() ? "none" : formats);
  }
  return *best;
}

int nearest_step(int wanted, std::uint32_t minimum, std::uint32_t maximum, std::uint32_t step) {
  const auto low = static_cast<std::int64_t>(minimum);
  const auto high = std::max(low, static_cast<std::int64_t>(maximum));
  const auto stride = std::max<std::int64_t>(1, step);
  const std::int64_t inside = std::clamp<std::int64_t>(wanted, low, high);
  return static_cast<int>(low + (inside - low) / stride * stride);
}

std::chrono::nanoseconds wished_interval(const CameraWish& wish) {
  return std::chrono::nanoseconds(std::llround(1e9 / wish.rate_hz));
}

}  // namespace trigmesh
