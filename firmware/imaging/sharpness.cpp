#include "firmware/imaging/sharpness.hpp"

#include "firmware/base/check.hpp"
#include "sfm/keyframes/sharpness.hpp"

namespace trigmesh {

Result<double> SharpnessMeter::measure(const FrameLayout& layout,
                                       std::span<const std::uint8_t> bytes) {
  TM_RETURN_IF_ERROR(reducer_.reduce(layout, bytes));
  return variance_of_laplacian(reducer_.grey());
}

}  // namespace trigmesh
