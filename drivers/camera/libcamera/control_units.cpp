#include "drivers/camera/libcamera/control_units.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "drivers/camera/control_lock.hpp"

namespace trigmesh {

double unit_of(ControlId id) {
  switch (id) {
    case ControlId::kGain:
    case ControlId::kWhiteBalance:
    case ControlId::kFocus:
      return 1000.0;
    default:
      return 1.0;
  }
}

std::int64_t to_our_unit(ControlId id, double theirs) {
  // Ranges of cameras reach to the ends of their types; doubles of this size round safely.
  constexpr double kLargest = 9.0e15;
  return std::llround(std::clamp(theirs * unit_of(id), -kLargest, kLargest));
}

double to_their_unit(ControlId id, std::int64_t ours) {
  return static_cast<double>(ours) / unit_of(id);
}

bool is_taken(ControlId id, std::int64_t asked, std::int64_t told) {
  if (is_automatism(id)) {
    return asked == told;
  }
  constexpr std::int64_t kPart = 50;
  return std::abs(asked - told) <= std::max<std::int64_t>(std::abs(asked) / kPart, 1);
}

}  // namespace trigmesh
