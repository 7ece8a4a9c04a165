#include "firmware/pipeline/build_options.hpp"

#include <array>
#include <bit>

#include "firmware/pipeline/named_value.hpp"

namespace trigmesh {

namespace {

constexpr std::array kLastStages{
    LastStage::kSparse, LastStage::kDense, LastStage::kMesh, LastStage::kTexture};
constexpr std::array kPresets{
    QualityPreset::kPreview, QualityPreset::kStandard, QualityPreset::kFine};
constexpr std::array kMovingUses{MovingUse::kAuto, MovingUse::kOff};

}  // namespace

std::string_view to_string(LastStage stage) {
  switch (stage) {
    case LastStage::kSparse:
      return "sparse";
    case LastStage::kDense:
      return "dense";
    case LastStage::kMesh:
      return "mesh";
    case LastStage::kTexture:
      break;
  }
  return "texture";
}

std::optional<LastStage> last_stage_from_string(std::string_view name) {
  return named_value(kLastStages, name);
}

std::string_view to_string(QualityPreset preset) {
  switch (preset) {
    case QualityPreset::kPreview:
      return "preview";
    case QualityPreset::kStandard:
      return "standard";
    case QualityPreset::kFine:
      break;
  }
  return "fine";
}

std::optional<QualityPreset> quality_preset_from_string(std::string_view name) {
  return named_value(kPresets, name);
}

std::string_view to_string(MovingUse use) {
  return use == MovingUse::kAuto ? "auto" : "off";
}

std::optional<MovingUse> moving_use_from_string(std::string_view name) {
  return named_value(kMovingUses, name);
}

Result<> BuildOptions::validate() const {
  constexpr int kMostFaces = 50'000'000;
  if (max_faces < 0 || max_faces > kMostFaces) {
    return fail(ErrorCode::kInvalidArgument,
                "max_faces is {}: it must be in [0, {}]",
                max_faces,
                kMostFaces);
  }
  if (map_side_px != 0 && (map_side_px < 64 || map_side_px > 8192)) {
    return fail(ErrorCode::kInvalidArgument,
                "map_side_px is {}: it must be 0 or in [64, 8192]",
                map_side_px);
  }
  if (preset == QualityPreset::kPreview && last_stage == LastStage::kDense) {
    return fail(ErrorCode::kInvalidArgument,
                "the preset preview makes no depth maps: it cannot stop after dense");
  }
  if (texture_size_px < 256 || texture_size_px > 16384 ||
      !std::has_single_bit(static_cast<unsigned>(texture_size_px))) {
    return fail(ErrorCode::kInvalidArgument,
                "texture_size_px is {}: it must be a power of two in [256, 16384]",
                texture_size_px);
  }
  return {};
}

}  // namespace trigmesh
