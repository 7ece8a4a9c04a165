#include "sfm/exchange/model_folder.hpp"

#include <array>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "firmware/base/check.hpp"
#include "sfm/exchange/colmap_binary.hpp"
#include "sfm/exchange/colmap_text.hpp"
#include "sfm/exchange/file_io.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

enum class Encoding { kText, kBinary };

struct ModelFolder {
  fs::path path;
  Encoding encoding = Encoding::kText;
};

bool is_file(const fs::path& path) {
  std::error_code ignored;  // what cannot be looked at is not there for us
  return fs::is_regular_file(path, ignored);
}

Result<ModelFolder> find_model(const fs::path& path) {
  static constexpr std::array<std::string_view, 4> kPlaces{
      "", "sparse", "model/sparse", "sparse/0"};
  for (const std::string_view place : kPlaces) {
    const fs::path folder = place.empty() ? path : path / place;
    if (is_file(folder / "images.txt")) {
      return ModelFolder{folder, Encoding::kText};
    }
    if (is_file(folder / "images.bin")) {
      return ModelFolder{folder, Encoding::kBinary};
    }
  }
  return fail(ErrorCode::kNotFound,
              "no model in {}: neither images.txt nor images.bin there, in sparse/, model/sparse/ "
              "or sparse/0/",
              path.string());
}

/// Says in which folder the file with the failure lies.
Error in_folder(Error error, const fs::path& folder) {
  error.message = fmt::format("{}: {}", folder.string(), error.message);
  return error;
}

/// What stands in a points3D file without points: nothing, or a count of zero.
std::string no_points(std::string_view extension) {
  return extension == ".bin" ? std::string(sizeof(std::uint64_t), '\0') : std::string();
}

template <typename Contents>
Result<Contents> read_contents(const fs::path& folder, std::string_view extension) {
  const auto read = [&](std::string_view name) {
    return read_file(folder / (std::string(name) += extension), kMaxModelFileBytes);
  };
  Contents contents;
  contents.points = no_points(extension);
  TM_ASSIGN_OR_RETURN(contents.cameras, read("cameras"));
  TM_ASSIGN_OR_RETURN(contents.images, read("images"));
  auto points = read("points3D");
  if (!points && points.error().code == ErrorCode::kNotFound) {
    return contents;  // cameras and poses alone; the images then name no points
  }
  TM_ASSIGN_OR_RETURN(contents.points, std::move(points));
  return contents;
}

template <typename Contents>
Result<> write_contents(const Contents& contents,
                        const fs::path& folder,
                        std::string_view extension) {
  const auto write = [&](std::string_view name, const std::string& bytes) {
    return write_file_atomically(folder / (std::string(name) += extension), bytes);
  };
  TM_RETURN_IF_ERROR(make_directory(folder));
  TM_RETURN_IF_ERROR(write("cameras", contents.cameras));
  TM_RETURN_IF_ERROR(write("images", contents.images));
  return write("points3D", contents.points);
}

}  // namespace

Result<Scene> read_model(const fs::path& path) {
  TM_ASSIGN_OR_RETURN(const ModelFolder folder, find_model(path));
  const auto add_folder = [&](Error error) { return in_folder(std::move(error), folder.path); };
  if (folder.encoding == Encoding::kText) {
    TM_ASSIGN_OR_RETURN(const ColmapText text, read_contents<ColmapText>(folder.path, ".txt"));
    return read_colmap_text(text).map_error(add_folder);
  }
  TM_ASSIGN_OR_RETURN(const ColmapBinary bytes, read_contents<ColmapBinary>(folder.path, ".bin"));
  return read_colmap_binary(bytes).map_error(add_folder);
}

Result<std::vector<NamedPose>> read_model_poses(const fs::path& path) {
  TM_ASSIGN_OR_RETURN(const ModelFolder folder, find_model(path));
  const bool is_text = folder.encoding == Encoding::kText;
  TM_ASSIGN_OR_RETURN(
      const std::string images,
      read_file(folder.path / (is_text ? "images.txt" : "images.bin"), kMaxModelFileBytes));
  auto poses = is_text ? read_colmap_poses(images) : read_colmap_binary_poses(images);
  return std::move(poses).map_error(
      [&](Error error) { return in_folder(std::move(error), folder.path); });
}

Result<> write_text_model(const Scene& scene, const fs::path& folder) {
  TM_ASSIGN_OR_RETURN(const ColmapText text, write_colmap_text(scene));
  return write_contents(text, folder, ".txt");
}

Result<> write_binary_model(const Scene& scene, const fs::path& folder) {
  TM_ASSIGN_OR_RETURN(const ColmapBinary bytes, write_colmap_binary(scene));
  return write_contents(bytes, folder, ".bin");
}

}  // namespace trigmesh
