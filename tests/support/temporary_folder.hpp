#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace trigmesh::test_support {

/// Where files are in memory only: for tests that make very many of them and never need the disk.
inline std::filesystem::path folder_in_memory() {
  const std::filesystem::path shared_memory = "/dev/shm";
  std::error_code ignored;
  return std::filesystem::is_directory(shared_memory, ignored)
             ? shared_memory
             : std::filesystem::temp_directory_path();
}

/// A new, empty folder that no other test has; it goes with everything in it when the object goes.
class TemporaryFolder {
 public:
  /// Throws std::system_error when there is no room for it: a test cannot go on then.
  TemporaryFolder() : TemporaryFolder(std::filesystem::temp_directory_path()) {}

  /// The same inside `parent`.
  explicit TemporaryFolder(const std::filesystem::path& parent) {
    std::string name = (parent / "trigmesh_test_XXXXXX").string();
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
