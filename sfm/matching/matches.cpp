#include "sfm/matching/matches.hpp"

namespace trigmesh {

std::string_view to_string(TwoViewKind kind) {
  switch (kind) {
    case TwoViewKind::kNone:
      return "none";
    case TwoViewKind::kGeneral:
      return "general";
    case TwoViewKind::kPlanar:
      return "planar";
    case TwoViewKind::kPureRotation:
      return "pure_rotation";
    case TwoViewKind::kWatermark:
      return "watermark";
    case TwoViewKind::kDuplicate:
      return "duplicate";
    case TwoViewKind::kLookAlike:
      return "look_alike";
  }
  return "none";
}

bool shows_one_scene(TwoViewKind kind) {
  return kind != TwoViewKind::kNone && kind != TwoViewKind::kWatermark &&
         kind != TwoViewKind::kLookAlike;
}

}  // namespace trigmesh
