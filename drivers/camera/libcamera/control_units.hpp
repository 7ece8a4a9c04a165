#pragma once

#include <cstdint>

#include "drivers/camera/camera_controls.hpp"

namespace trigmesh {

/// Our whole numbers are libcamera's times this: gain, colour gains and lens position are factors
/// and dioptres with a fraction there, thousandths here; exposure is in microseconds on both sides.
[[nodiscard]] double unit_of(ControlId id);

/// libcamera's number in our units, rounded.
[[nodiscard]] std::int64_t to_our_unit(ControlId id, double theirs);

/// Ours in libcamera's.
[[nodiscard]] double to_their_unit(ControlId id, std::int64_t ours);

/// Whether a camera that was asked for one value and tells the other has taken it: sensors count
/// exposure in rows and gain in steps, so 2 % beside is still that value. Automatisms: the same.
[[nodiscard]] bool is_taken(ControlId id, std::int64_t asked, std::int64_t told);

}  // namespace trigmesh
