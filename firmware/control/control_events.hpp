#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "firmware/control/control_target.hpp"

namespace trigmesh {

// What the events say, as one line of JSON each. Kinds are letters only. Watchers read `phase`,
// `frame`, `model`, `progress` and `export`; other kinds are for people.

inline constexpr std::string_view kPhaseEvent = "phase";
inline constexpr std::string_view kFrameEvent = "frame";
inline constexpr std::string_view kModelEvent = "model";
inline constexpr std::string_view kProgressEvent = "progress";
inline constexpr std::string_view kExportEvent = "export";

/// The rig does something else now.
[[nodiscard]] std::string render_phase_event(RigPhase phase, std::string_view session_id);

/// A frame was kept or discarded: how many the session has.
[[nodiscard]] std::string render_frame_event(std::string_view session_id, std::uint32_t frames);

/// How the making of a model ended.
enum class ModelEventOutcome : std::uint8_t { kReady, kNone, kFailed, kCancelled };

/// "ready", "none", "failed", "cancelled".
[[nodiscard]] std::string_view to_string(ModelEventOutcome outcome);

struct ModelEvent {
  std::string session_id;
  ModelEventOutcome outcome = ModelEventOutcome::kFailed;
  std::string message;  ///< one sentence

  bool operator==(const ModelEvent&) const = default;
};

[[nodiscard]] std::string render_model_event(const ModelEvent& event);

/// How far a model is.
struct ProgressEvent {
  std::string session_id;
  std::string stage;        ///< "mapping"
  std::uint64_t done = 0;   ///< pieces
  std::uint64_t total = 0;  ///< 0: not known

  bool operator==(const ProgressEvent&) const = default;
};

[[nodiscard]] std::string render_progress_event(const ProgressEvent& event);

/// How far an export is.
struct ExportEvent {
  std::string session_id;
  std::uint64_t copied_bytes = 0;
  std::uint64_t all_bytes = 0;

  bool operator==(const ExportEvent&) const = default;
};

[[nodiscard]] std::string render_export_event(const ExportEvent& event);

}  // namespace trigmesh
