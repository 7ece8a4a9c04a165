#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"
#include "firmware/session/journal_records.hpp"

namespace trigmesh {

/// What session.json says: what a session is and where it stands. The journal has the details and
/// is right where the two differ (the power went between them).
struct SessionManifest {
  std::string id;
  SessionState state = SessionState::kCapturing;
  std::chrono::nanoseconds created_wall{};  ///< what the clock said, since 1970
  std::uint32_t frame_count = 0;            ///< kept frames; right from the closing on
  std::string mode;                         ///< "still", "video"
  std::string camera_profile;               ///< the profile as TOML; empty: none was given
  std::string software_version;
  std::string settings;          ///< as TOML
  std::uint32_t recoveries = 0;  ///< how often it was found open after a crash
  bool exported = false;         ///< a verified copy was made after the last change

  bool operator==(const SessionManifest&) const = default;
};

/// JSON, indented, with a line feed at the end.
[[nodiscard]] std::string render_manifest(const SessionManifest& manifest);

/// kCorruptData (names `source` and the key), kUnsupported for a later format. Unknown keys are not
/// looked at, texts are bounded by kMaxJournalTextBytes.
[[nodiscard]] Result<SessionManifest> parse_manifest(std::string_view json,
                                                     std::string_view source);

/// From and to `session`/session.json; written atomically and durable.
[[nodiscard]] Result<SessionManifest> read_manifest(FileSystem& files,
                                                    const std::filesystem::path& session);
[[nodiscard]] Result<> write_manifest(FileSystem& files,
                                      const std::filesystem::path& session,
                                      const SessionManifest& manifest);

}  // namespace trigmesh
