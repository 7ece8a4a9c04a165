#include "drivers/camera/camera_controls.hpp"

namespace trigmesh {

std::string_view to_string(ControlId id) {
  switch (id) {
    case ControlId::kExposureAuto:
      return "exposure automatic";
    case ControlId::kExposure:
      return "exposure";
    case ControlId::kGainAuto:
      return "gain automatic";
    case ControlId::kGain:
      return "gain";
    case ControlId::kWhiteBalanceAuto:
      return "white balance automatic";
    case ControlId::kWhiteBalance:
      return "white balance";
    case ControlId::kFocusAuto:
      return "focus automatic";
    case ControlId::kFocus:
      return "focus";
  }
  return "unknown";
}

}  // namespace trigmesh
