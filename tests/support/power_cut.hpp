#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "firmware/base/unique_fd.hpp"

namespace trigmesh::test_support {

/// What a power cut would take away: changes of files and folders that no fsync has made safe. Told
/// of every change before it is made and of every fsync, it can take the unsafe ones back, as a
/// disk does that never saw them. Stricter than most file systems: the fsync of a new file does not
/// make its name safe, only that of its folder does.
class PowerCut {
 public:
  /// `aside`: an empty folder on the same file system, for what was removed.
  explicit PowerCut(std::filesystem::path aside) : aside_(std::move(aside)) {}

  void before_open_for_writing(const std::filesystem::path& path);
  void before_write(int fd);
  void before_truncate(int fd);
  void before_rename(const std::filesystem::path& from, const std::filesystem::path& to);
  void before_exchange(const std::filesystem::path& a, const std::filesystem::path& b);
  void before_remove(const std::filesystem::path& path);
  void before_make_folder(const std::filesystem::path& path);
  void after_sync(int fd);

  /// Takes all unsafe changes back, the newest first.
  void lose_everything();
  /// Takes about half of them back: a disk may have written any of them.
  void lose_some(std::uint64_t seed);

 private:
  /// A name in a folder, which may itself get another name later.
  struct Place {
    std::shared_ptr<UniqueFd> folder;
    std::string name;
  };

  struct Change {
    std::pair<dev_t, ino_t> made_safe_by;  ///< the fsync of this file or folder
    std::function<void()> take_back;
  };

  [[nodiscard]] Place place_of(const std::filesystem::path& path) const;
  /// A second name for the file at `path`, so that it survives its removal; empty if there is none.
  [[nodiscard]] std::filesystem::path keep_aside(const std::filesystem::path& path);
  void add(int fd, std::function<void()> take_back);

  std::filesystem::path aside_;
  std::size_t kept_aside_ = 0;
  std::vector<Change> unsafe_;
};

}  // namespace trigmesh::test_support
