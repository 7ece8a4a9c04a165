#pragma once

#include <string>
#include <string_view>

namespace trigmesh {

/// `folder/name`, or the name alone when the folder is empty.
[[nodiscard]] inline std::string image_path(std::string_view folder, std::string_view name) {
  std::string path(folder);
  if (!path.empty() && !path.ends_with('/')) {
    path += '/';
  }
  return path += name;
}

}  // namespace trigmesh
