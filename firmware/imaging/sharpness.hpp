#pragma once

#include <cstdint>
#include <span>

#include "firmware/base/result.hpp"
#include "firmware/imaging/grey_reducer.hpp"

namespace trigmesh {

/// Says how sharp frames are, to compare frames of one scene: the variance of the Laplacian
/// (4 neighbours) of the brightness, at the reduced size of GreyReducer. Thread-compatible.
class SharpnessMeter {
 public:
  /// 0: no edge at all, or fewer than 3 pixels on a side. Errors: those of GreyReducer.
  [[nodiscard]] Result<double> measure(const FrameLayout& layout,
                                       std::span<const std::uint8_t> bytes);

 private:
  GreyReducer reducer_;
};

}  // namespace trigmesh
