#include "firmware/photos/session_options.hpp"

#include <algorithm>
#include <array>
#include <thread>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_system.hpp"
#include "firmware/session/manifest.hpp"
#include "sfm/exchange/camera_profile.hpp"

namespace trigmesh {
namespace {

constexpr std::uint64_t kMegabyte = 1'000'000;
constexpr int kMostThreads = 256;

QualityPreset preset_of(ReconstructionSettings::Preset preset) {
  switch (preset) {
    case ReconstructionSettings::Preset::kPreview:
      return QualityPreset::kPreview;
    case ReconstructionSettings::Preset::kStandard:
      return QualityPreset::kStandard;
    case ReconstructionSettings::Preset::kFine:
      break;
  }
  return QualityPreset::kFine;
}

/// What is known of markers. The dictionaries stand in the order of their bits, then their size.
ScaleOptions scale_options(const ScaleSettings& settings) {
  constexpr std::array kBits{4, 5, 6};
  constexpr std::array kCounts{50, 100, 250, 1000};
  const auto dictionary = static_cast<std::size_t>(settings.dictionary);
  ScaleOptions options;
  options.dictionary = {.bits = kBits.at(dictionary / kCounts.size()),
                        .count = kCounts.at(dictionary % kCounts.size())};
  if (settings.marker_side_m > 0.0) {
    options.known.marker_side_m = settings.marker_side_m;
  }
  options.known.side_of_marker_m = settings.marker_sides_m;
  options.known.distance_m = settings.marker_distances_m;
  options.up = settings.up == ScaleSettings::Up::kCard ? UpSource::kCard : UpSource::kNone;
  return options;
}

int thread_count(int wanted) {
  return wanted > 0
             ? wanted
             : std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, kMostThreads);
}

}  // namespace

ReconstructionOptions model_options(const ReconstructionSettings& settings,
                                    const ScaleSettings& scale,
                                    const std::string& software_version) {
  ReconstructionOptions options;
  options.scale = scale_options(scale);
  options.build.preset = preset_of(settings.preset);
  options.num_threads = thread_count(settings.threads);
  options.memory_limit_bytes = kMegabyte * static_cast<std::uint64_t>(settings.memory_limit_mb);
  options.seed = static_cast<std::uint64_t>(settings.seed);
  options.software_version = software_version;
  return options;
}

Result<std::vector<Camera>> cameras_of_profile(const std::string& profile,
                                               const std::string& session_id) {
  if (profile.empty()) {
    return std::vector<Camera>();
  }
  TM_ASSIGN_OR_RETURN(
      const CameraProfile parsed,
      parse_camera_profile(profile, fmt::format("camera profile of session {}", session_id)));
  return std::vector{parsed.camera};
}

Result<ReconstructionOptions> options_of_session(const std::filesystem::path& session,
                                                 const std::string& software_version) {
  TM_ASSIGN_OR_RETURN(const SessionManifest manifest, read_manifest(real_file_system(), session));
  TM_ASSIGN_OR_RETURN(
      const Settings settings,
      parse_settings(manifest.settings, fmt::format("settings of session {}", manifest.id)));
  ReconstructionOptions options =
      model_options(settings.reconstruction, settings.scale, software_version);
  TM_ASSIGN_OR_RETURN(options.cameras, cameras_of_profile(manifest.camera_profile, manifest.id));
  return options;
}

}  // namespace trigmesh
