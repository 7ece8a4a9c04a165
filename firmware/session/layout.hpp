#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace trigmesh {

// Names in the folder of a session. Hidden names (a dot in front) are work in progress; after a
// crash they are removed, except the finished pieces of a model that is still to be made.
inline constexpr std::string_view kManifestName = "session.json";
inline constexpr std::string_view kJournalName = "journal";
inline constexpr std::string_view kFramesName = "frames";
inline constexpr std::string_view kFrameTableName = "frames.csv";
inline constexpr std::string_view kModelName = "model";
inline constexpr std::string_view kWorkName = ".work";

// Names in the folder of all sessions: one that is being made, and one that is being removed.
inline constexpr std::string_view kNewPrefix = ".new-";
inline constexpr std::string_view kTrashPrefix = ".trash-";

/// "000123.jpg". Numbers above 999999 get more digits.
[[nodiscard]] std::string frame_file_name(std::uint32_t number);

/// The number of such a name; nothing for any other name.
[[nodiscard]] std::optional<std::uint32_t> frame_number_of(std::string_view file_name);

[[nodiscard]] inline bool is_hidden_name(std::string_view name) {
  return name.starts_with('.');
}

}  // namespace trigmesh
