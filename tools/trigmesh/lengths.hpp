#pragma once

#include <string>
#include <string_view>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// What a number without a unit means.
enum class BareNumber { kRefused, kMetres };

/// Metres of a length with its unit: "25mm", "2.5cm", "0.025m". kInvalidArgument, naming `option`:
/// no such length, or not greater than 0.
[[nodiscard]] Result<double> parse_length_m(std::string_view option,
                                            std::string_view text,
                                            BareNumber bare);

}  // namespace trigmesh
