#include "firmware/session/manifest.hpp"

#include <limits>
#include <optional>

#include <nlohmann/json.hpp>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/session/layout.hpp"
#include "firmware/session/session_id.hpp"

namespace trigmesh {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t kFormat = 1;
constexpr std::size_t kMaxManifestBytes = std::size_t{4} << 20U;

/// Takes typed values out of an object; every complaint names file and key.
class ManifestReader {
 public:
  ManifestReader(const Json& json, std::string_view source) : json_(json), source_(source) {}

  [[nodiscard]] tl::unexpected<Error> complain(std::string_view key, std::string_view what) const {
    return fail(ErrorCode::kCorruptData, "{}: \"{}\" must be {}", source_, key, what);
  }

  [[nodiscard]] Result<std::string> text(const char* key) const {
    const auto found = json_.find(key);
    if (found == json_.end() || !found->is_string() ||
        found->get_ref<const std::string&>().size() > kMaxJournalTextBytes) {
      return complain(key, "a text of reasonable length");
    }
    return found->get<std::string>();
  }

  [[nodiscard]] Result<std::int64_t> whole(const char* key, std::int64_t min, std::int64_t max) {
    const auto found = json_.find(key);
    if (found == json_.end() || !found->is_number_integer()) {
      return complain(key, "a whole number");
    }
    const bool too_large = found->is_number_unsigned() &&
                           found->get<std::uint64_t>() >
                               static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    if (too_large || found->get<std::int64_t>() < min || found->get<std::int64_t>() > max) {
      return complain(key, fmt::format("in [{}, {}]", min, max));
    }
    return found->get<std::int64_t>();
  }

  [[nodiscard]] Result<std::uint32_t> count(const char* key) {
    return whole(key, 0, std::numeric_limits<std::uint32_t>::max()).map([](std::int64_t value) {
      return static_cast<std::uint32_t>(value);
    });
  }

  [[nodiscard]] Result<bool> truth(const char* key) const {
    const auto found = json_.find(key);
    if (found == json_.end() || !found->is_boolean()) {
      return complain(key, "true or false");
    }
    return found->get<bool>();
  }

  [[nodiscard]] Result<SessionState> state(const char* key) const {
    TM_ASSIGN_OR_RETURN(const std::string name, text(key));
    for (int i = 0; i <= static_cast<int>(SessionState::kModelFailed); ++i) {
      const auto candidate = static_cast<SessionState>(i);
      if (to_string(candidate) == name) {
        return candidate;
      }
    }
    return complain(key, "a state of a session");
  }

 private:
  const Json& json_;
  std::string_view source_;
};

Result<SessionManifest> manifest_from(const Json& json, std::string_view source) {
  ManifestReader reader(json, source);
  TM_ASSIGN_OR_RETURN(const std::int64_t format,
                      reader.whole("format", 1, std::numeric_limits<std::int64_t>::max()));
  if (format != kFormat) {
    return fail(ErrorCode::kUnsupported,
                "{}: has format {}, this program reads {}",
                source,
                format,
                kFormat);
  }
  SessionManifest manifest;
  TM_ASSIGN_OR_RETURN(manifest.id, reader.text("id"));
  if (!is_session_id(manifest.id)) {
    return reader.complain("id", "like 20261125T145054Z-3fa9c1");
  }
  TM_ASSIGN_OR_RETURN(manifest.state, reader.state("state"));
  TM_ASSIGN_OR_RETURN(const std::int64_t created,
                      reader.whole("created_wall_ns",
                                   std::numeric_limits<std::int64_t>::min(),
                                   std::numeric_limits<std::int64_t>::max()));
  manifest.created_wall = std::chrono::nanoseconds(created);
  TM_ASSIGN_OR_RETURN(manifest.frame_count, reader.count("frame_count"));
  TM_ASSIGN_OR_RETURN(manifest.mode, reader.text("mode"));
  TM_ASSIGN_OR_RETURN(manifest.camera_profile, reader.text("camera_profile"));
  TM_ASSIGN_OR_RETURN(manifest.software_version, reader.text("software_version"));
  TM_ASSIGN_OR_RETURN(manifest.settings, reader.text("settings"));
  TM_ASSIGN_OR_RETURN(manifest.recoveries, reader.count("recoveries"));
  TM_ASSIGN_OR_RETURN(manifest.exported, reader.truth("exported"));
  return manifest;
}

}  // namespace

std::string render_manifest(const SessionManifest& manifest) {
  Json json;
  json["format"] = kFormat;
  json["id"] = manifest.id;
  json["state"] = to_string(manifest.state);
  json["created_wall_ns"] = static_cast<std::int64_t>(manifest.created_wall.count());
  json["frame_count"] = manifest.frame_count;
  json["mode"] = manifest.mode;
  json["camera_profile"] = manifest.camera_profile;
  json["software_version"] = manifest.software_version;
  json["settings"] = manifest.settings;
  json["recoveries"] = manifest.recoveries;
  json["exported"] = manifest.exported;
  // Bytes that are no UTF-8 are replaced: a wrong letter in a name must not lose a session.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<SessionManifest> parse_manifest(std::string_view text, std::string_view source) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) {
    return fail(ErrorCode::kCorruptData, "{}: is not a JSON object", source);
  }
  return manifest_from(json, source);
}

Result<SessionManifest> read_manifest(FileSystem& files, const std::filesystem::path& session) {
  const std::filesystem::path path = session / kManifestName;
  TM_ASSIGN_OR_RETURN(const std::string text, read_file(files, path, kMaxManifestBytes));
  return parse_manifest(text, path.string());
}

Result<> write_manifest(FileSystem& files,
                        const std::filesystem::path& session,
                        const SessionManifest& manifest) {
  return write_file_atomically(files, session / kManifestName, render_manifest(manifest));
}

}  // namespace trigmesh
