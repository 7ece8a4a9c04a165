#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware/base/file_system.hpp"
#include "firmware/session/store.hpp"

namespace trigmesh::test_support {

/// What the rig has been told: a file beside the store, a line for each promise, written before the
/// next system call of the store.
class Promises {
 public:
  explicit Promises(std::filesystem::path path) : path_(std::move(path)) {}

  void add(const std::string& what, std::uint32_t number) const;

  /// Numbers of the lines that say `what`, in order.
  [[nodiscard]] std::vector<std::uint32_t> all(const std::string& what) const;

 private:
  std::filesystem::path path_;
};

/// The picture with this number: some bytes that no other one has.
[[nodiscard]] std::vector<std::uint8_t> picture(std::uint32_t number);

/// The names of the files of a model; each holds the version of the model.
[[nodiscard]] const std::vector<std::string>& model_file_names();

[[nodiscard]] StoreOptions script_options(const std::filesystem::path& root);

/// One session as a rig makes it: begin, twelve frames, one of them undone, close, a model, a
/// second model. Goes on after failures, as the rig does.
void run_session_script(FileSystem& files,
                        const std::filesystem::path& root,
                        const Promises& promises);

}  // namespace trigmesh::test_support
