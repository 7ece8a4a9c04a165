#include "sfm/keyframes/frame_verdict.hpp"

#include <array>

namespace trigmesh {

std::string_view to_string(FrameVerdict verdict) {
  constexpr std::array<std::string_view, 8> kNames = {"kept",
                                                      "blurred",
                                                      "too little motion",
                                                      "too fast",
                                                      "exposure jump",
                                                      "duplicate",
                                                      "track lost",
                                                      "over budget"};
  return kNames[static_cast<std::size_t>(verdict)];
}

}  // namespace trigmesh
