#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace trigmesh::test_support {

/// A new, empty folder that no other test has; it goes with everything in it when the object goes.
class TemporaryFolder {
 public:
  /// Throws std::system_error when there is no room for it: a test cannot go on then.
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "trigmesh_test_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw std::system_error(errno, std::generic_category(), "cannot make " + name);
    }
    path_ = name;
  }

  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  ~TemporaryFolder() {
    std::error_code ignored;  // a process that ends late may still hold a file
    std::filesystem::remove_all(path_, ignored);
  }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace trigmesh::test_support
