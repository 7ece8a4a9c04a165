#include "firmware/pipeline/progress.hpp"

namespace trigmesh {

std::string_view to_string(Stage stage) {
  switch (stage) {
    case Stage::kReadVideo:
      return "video";
    case Stage::kSelectFrames:
      return "frames";
    case Stage::kExtract:
      return "features";
    case Stage::kSelectPairs:
      return "pairs";
    case Stage::kMatch:
      return "matching";
    case Stage::kMap:
      return "mapping";
    case Stage::kScale:
      return "scale";
    case Stage::kDepth:
      return "depth";
    case Stage::kMoving:
      return "moving";
    case Stage::kFuse:
      return "fusion";
    case Stage::kSurface:
      return "surface";
    case Stage::kTexture:
      return "texture";
    case Stage::kWrite:
      break;
  }
  return "writing";
}

}  // namespace trigmesh
