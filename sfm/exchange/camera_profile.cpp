#include "sfm/exchange/camera_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "firmware/base/check.hpp"
#include "sfm/exchange/colmap_text.hpp"
#include "sfm/exchange/file_io.hpp"

namespace trigmesh {
namespace {

constexpr std::int64_t kFormat = 1;
constexpr std::size_t kMaxProfileBytes = std::size_t{64} << 10U;
constexpr std::size_t kMaxCameraFileBytes = std::size_t{16} << 20U;
constexpr std::size_t kMaxTextBytes = 128;
constexpr std::int64_t kMaxSidePx = 100'000;

constexpr std::array<std::string_view, 12> kKeys = {"format",
                                                    "name",
                                                    "serial",
                                                    "model",
                                                    "width_px",
                                                    "height_px",
                                                    "fx_px",
                                                    "fy_px",
                                                    "cx_px",
                                                    "cy_px",
                                                    "distortion",
                                                    "rms_px"};

/// Takes typed values out of a table; every complaint names file, line and key.
class ProfileTable {
 public:
  ProfileTable(const toml::table& table, std::string_view file) : table_(table), file_(file) {}

  [[nodiscard]] tl::unexpected<Error> complain(ErrorCode code,
                                               std::string_view key,
                                               std::string_view reason) const {
    const toml::node* node = table_.get(key);
    return node == nullptr
               ? fail(code, "{}: {}: {}", file_, key, reason)
               : fail(code, "{}:{}: {}: {}", file_, node->source().begin.line, key, reason);
  }

  [[nodiscard]] Result<> check_keys() const {
    for (const auto& [key, node] : table_) {
      if (std::find(kKeys.begin(), kKeys.end(), key.str()) == kKeys.end()) {
        return fail(ErrorCode::kCorruptData,
                    "{}:{}: unknown key '{}'",
                    file_,
                    node.source().begin.line,
                    key.str());
      }
    }
    return {};
  }

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }

  [[nodiscard]] Result<std::int64_t> integer(std::string_view key,
                                             std::int64_t min,
                                             std::int64_t max) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      return complain(ErrorCode::kCorruptData, key, "is missing");
    }
    const std::optional<std::int64_t> value = node->value_exact<std::int64_t>();
    if (!value || *value < min || *value > max) {
      return complain(ErrorCode::kCorruptData,
                      key,
                      fmt::format("must be a whole number in [{}, {}]", min, max));
    }
    return *value;
  }

  [[nodiscard]] Result<double> number(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      return complain(ErrorCode::kCorruptData, key, "is missing");
    }
    const std::optional<double> value = node->is_number() ? node->value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value)) {
      return complain(ErrorCode::kCorruptData, key, "must be a finite number");
    }
    return *value;
  }

  /// Empty when absent.
  [[nodiscard]] Result<std::string> text(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      return std::string();
    }
    std::optional<std::string> value = node->value_exact<std::string>();
    if (!value || value->size() > kMaxTextBytes) {
      return complain(ErrorCode::kCorruptData,
                      key,
                      fmt::format("must be a text of at most {} bytes", kMaxTextBytes));
    }
    return *std::move(value);
  }

  /// Exactly `count` numbers; absent means none.
  [[nodiscard]] Result<std::array<double, 4>> coefficients(std::string_view key,
                                                           std::size_t count) const {
    std::array<double, 4> values{};
    const toml::array* array = table_[key].as_array();
    if (array == nullptr && !has(key) && count == 0) {
      return values;
    }
    if (array == nullptr || array->size() != count) {
      return complain(ErrorCode::kCorruptData,
                      key,
                      fmt::format("this model needs a list of {} numbers", count));
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::optional<double> value =
          array->at(i).is_number() ? array->at(i).value<double>() : std::nullopt;
      if (!value || !std::isfinite(*value)) {
        return complain(
            ErrorCode::kCorruptData, key, "holds something that is not a finite number");
      }
      values[i] = *value;
    }
    return values;
  }

 private:
  const toml::table& table_;
  std::string_view file_;
};

Result<Camera> camera_from(const ProfileTable& table) {
  Camera camera;
  TM_ASSIGN_OR_RETURN(const std::string model_name, table.text("model"));
  const std::optional<CameraModel> model = camera_model_from_string(model_name);
  if (!model) {
    return table.complain(ErrorCode::kCorruptData,
                          "model",
                          "must be one of pinhole, radial, brown_conrady, kannala_brandt");
  }
  camera.model = *model;
  TM_ASSIGN_OR_RETURN(const std::int64_t width, table.integer("width_px", 1, kMaxSidePx));
  TM_ASSIGN_OR_RETURN(const std::int64_t height, table.integer("height_px", 1, kMaxSidePx));
  camera.width_px = static_cast<int>(width);
  camera.height_px = static_cast<int>(height);
  TM_ASSIGN_OR_RETURN(camera.fx_px, table.number("fx_px"));
  TM_ASSIGN_OR_RETURN(camera.fy_px, table.number("fy_px"));
  TM_ASSIGN_OR_RETURN(camera.cx_px, table.number("cx_px"));
  TM_ASSIGN_OR_RETURN(camera.cy_px, table.number("cy_px"));
  TM_ASSIGN_OR_RETURN(
      camera.distortion,
      table.coefficients("distortion", static_cast<std::size_t>(distortion_count(*model))));
  return camera;
}

Result<CameraProfile> profile_from(const toml::table& root, std::string_view file) {
  const ProfileTable table(root, file);
  // The number first: a later format may have other keys.
  const Result<std::int64_t> format = table.integer("format", 1, std::int64_t{1} << 31U);
  if (!format) {
    return fail(ErrorCode::kCorruptData,
                "{}; the first key of a camera profile is format = {}",
                format.error().message,
                kFormat);
  }
  if (*format != kFormat) {
    return table.complain(ErrorCode::kUnsupported,
                          "format",
                          fmt::format("is {}, this build reads {}", *format, kFormat));
  }
  TM_RETURN_IF_ERROR(table.check_keys());
  CameraProfile profile;
  TM_ASSIGN_OR_RETURN(profile.name, table.text("name"));
  TM_ASSIGN_OR_RETURN(profile.serial, table.text("serial"));
  TM_ASSIGN_OR_RETURN(profile.camera, camera_from(table));
  if (table.has("rms_px")) {
    TM_ASSIGN_OR_RETURN(profile.rms_px, table.number("rms_px"));
    if (*profile.rms_px < 0.0) {
      return table.complain(ErrorCode::kCorruptData, "rms_px", "must be 0 or more");
    }
  }
  const Result<> valid = profile.camera.validate();
  if (!valid) {
    return fail(ErrorCode::kCorruptData, "{}: {}", file, valid.error().message);
  }
  return profile;
}

/// A TOML string with quotes and escapes.
std::string quoted(const std::string& text) {
  std::ostringstream stream;
  stream << toml::value<std::string>(text);
  return stream.str();
}

/// The shortest text that reads back as the same double.
std::string exact(double value) {
  return fmt::format("{}", value);
}

/// The camera list of COLMAP begins with a number, a profile with a key.
bool looks_like_colmap(std::string_view text) {
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin != std::string_view::npos && line[begin] != '#') {
      return line[begin] >= '0' && line[begin] <= '9';
    }
    text.remove_prefix(std::min(text.size(), line.size() + 1));
  }
  return false;
}

Result<std::vector<CameraProfile>> profiles_from_colmap(std::string_view text,
                                                        std::string_view file) {
  const Result<std::vector<ColmapCamera>> cameras = read_colmap_cameras(text);
  if (!cameras) {
    return fail(cameras.error().code, "{}: {}", file, cameras.error().message);
  }
  std::vector<CameraProfile> profiles;
  for (const auto& [id, camera] : *cameras) {
    profiles.push_back({camera, fmt::format("camera {}", id), {}, std::nullopt});
  }
  return profiles;
}

}  // namespace

Result<CameraProfile> parse_camera_profile(std::string_view text, std::string_view file) {
  if (text.size() > kMaxProfileBytes) {
    return fail(ErrorCode::kLimitExceeded,
                "{} has {} bytes; a camera profile has at most {}",
                file,
                text.size(),
                kMaxProfileBytes);
  }
  try {
    return profile_from(toml::parse(text), file);
  } catch (const toml::parse_error& error) {
    return fail(
        ErrorCode::kCorruptData, "{}:{}: {}", file, error.source().begin.line, error.description());
  } catch (const std::exception& error) {
    return fail(ErrorCode::kCorruptData, "{}: {}", file, error.what());
  }
}

Result<std::string> format_camera_profile(const CameraProfile& profile) {
  const Camera& camera = profile.camera;
  TM_RETURN_IF_ERROR(camera.validate());
  std::string text =
      "# Trigmesh camera profile. Pixels: the centre of the first pixel is (0, 0).\n";
  auto out = std::back_inserter(text);
  fmt::format_to(out, "format = {}\n", kFormat);
  if (!profile.name.empty()) {
    fmt::format_to(out, "name = {}\n", quoted(profile.name));
  }
  if (!profile.serial.empty()) {
    fmt::format_to(out, "serial = {}\n", quoted(profile.serial));
  }
  fmt::format_to(out, "model = \"{}\"\n", to_string(camera.model));
  fmt::format_to(out, "width_px = {}\nheight_px = {}\n", camera.width_px, camera.height_px);
  fmt::format_to(out, "fx_px = {}\nfy_px = {}\n", exact(camera.fx_px), exact(camera.fy_px));
  fmt::format_to(out, "cx_px = {}\ncy_px = {}\n", exact(camera.cx_px), exact(camera.cy_px));
  const int count = distortion_count(camera.model);
  for (int i = 0; i < count; ++i) {
    const double value = camera.distortion[static_cast<std::size_t>(i)];
    fmt::format_to(out, "{}{}", i == 0 ? "distortion = [" : ", ", exact(value));
  }
  text += count > 0 ? "]\n" : "";
  if (profile.rms_px) {
    fmt::format_to(out, "rms_px = {}\n", exact(*profile.rms_px));
  }
  return text;
}

Result<std::vector<CameraProfile>> parse_camera_file(std::string_view text, std::string_view file) {
  if (looks_like_colmap(text)) {
    return profiles_from_colmap(text, file);
  }
  TM_ASSIGN_OR_RETURN(CameraProfile profile, parse_camera_profile(text, file));
  return std::vector<CameraProfile>{std::move(profile)};
}

Result<std::vector<CameraProfile>> read_camera_file(const std::filesystem::path& path) {
  TM_ASSIGN_OR_RETURN(const std::string text, read_file(path, kMaxCameraFileBytes));
  return parse_camera_file(text, path.string());
}

}  // namespace trigmesh
