#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/session/store.hpp"
#include "tests/support/manual_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh::test_support {

/// The COLMAP file with the camera of the demo recording.
[[nodiscard]] std::filesystem::path demo_camera_file();

/// The same camera as a profile of ours, as a session carries it.
[[nodiscard]] std::string demo_camera_profile();

/// Bytes of every `step`-th picture of the demo recording.
[[nodiscard]] std::vector<std::vector<std::uint8_t>> demo_pictures(std::size_t step);

/// A store in a folder of its own, with closed sessions of given pictures.
class DemoStore {
 public:
  DemoStore();

  /// A closed session; its id.
  std::string add(const std::vector<std::vector<std::uint8_t>>& pictures,
                  const std::string& camera_profile);

  /// Opened; what a crash left is put right.
  [[nodiscard]] Session open(const std::string& id);

  [[nodiscard]] std::filesystem::path folder_of(const std::string& id) const {
    return store_->folder_of(id);
  }

  /// As after a restart of the program.
  void reopen();

 private:
  TemporaryFolder temporary_;
  ManualClock clock_;
  ManualWallClock wall_clock_;
  std::optional<SessionStore> store_;
};

}  // namespace trigmesh::test_support
