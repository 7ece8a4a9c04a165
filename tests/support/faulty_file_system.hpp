#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "firmware/base/file_system.hpp"
#include "tests/support/power_cut.hpp"

namespace trigmesh::test_support {

/// What goes wrong, at one system call.
enum class FaultKind {
  kNone,
  kFail,           ///< the call fails
  kFailFromThere,  ///< the call and all that change something after it fail: the disk is full, gone
  kShortThenFail,  ///< a write takes half of its bytes, the next call fails
  kShortWrite,     ///< a write takes one byte; nothing fails
  kKill,           ///< the process ends before the call
  kTornWriteKill,  ///< the process ends after half of the write
  kPowerCut,       ///< the process ends before the call, and everything unsafe is lost
  kPowerCutPartly,  ///< the same, and some of what is unsafe is lost
};

struct Fault {
  FaultKind kind = FaultKind::kNone;
  std::size_t at_call = 0;  ///< from 1
  int error_number = EIO;
};

/// How the process ends when a fault kills it.
inline constexpr int kKilledExitCode = 86;

/// The machine's files, with a fault at one call. Counts all calls, also those that only look.
class FaultyFileSystem final : public RealFileSystem {
 public:
  FaultyFileSystem() = default;

  /// `aside`: for the kinds with a power cut, an empty folder on the same file system.
  FaultyFileSystem(const Fault& fault, const std::filesystem::path& aside)
      : fault_(fault), power_cut_(std::in_place, aside) {}

  void set_fault(const Fault& fault) { fault_ = fault; }

  /// What space() says is free, whatever the disk has.
  void pretend_free(std::optional<std::uint64_t> bytes) { free_bytes_ = bytes; }

  [[nodiscard]] std::size_t calls() const { return calls_; }

  /// Which of them were writes; from 1.
  [[nodiscard]] const std::vector<std::size_t>& write_calls() const { return write_calls_; }

  [[nodiscard]] SystemResult<int> open(const Path& path, OpenMode mode) override;
  [[nodiscard]] SystemResult<std::size_t> write(int fd, std::string_view bytes) override;
  [[nodiscard]] SystemResult<std::size_t> read(int fd, std::span<char> room) override;
  [[nodiscard]] SystemResult<> sync(int fd) override;
  [[nodiscard]] SystemResult<> truncate(int fd, std::uint64_t size_bytes) override;
  [[nodiscard]] SystemResult<> forget_cached(int fd) override;
  [[nodiscard]] SystemResult<> close(int fd) override;
  [[nodiscard]] SystemResult<> rename(const Path& from, const Path& to) override;
  [[nodiscard]] SystemResult<> exchange(const Path& a, const Path& b) override;
  [[nodiscard]] SystemResult<> remove_file(const Path& path) override;
  [[nodiscard]] SystemResult<> remove_folder(const Path& path) override;
  [[nodiscard]] SystemResult<> make_folder(const Path& path) override;
  [[nodiscard]] SystemResult<std::vector<FolderEntry>> list(const Path& folder) override;
  [[nodiscard]] SystemResult<FileStatus> status(const Path& path) override;
  [[nodiscard]] SystemResult<DiskSpace> space(const Path& path) override;

 private:
  enum class Effect { kLooks, kChanges };

  /// Counts a call; the errno with which it fails, 0: it goes on. May not return.
  [[nodiscard]] int next_call(Effect effect);
  [[noreturn]] void end_process();

  Fault fault_;
  std::optional<PowerCut> power_cut_;
  std::optional<std::uint64_t> free_bytes_;
  std::size_t calls_ = 0;
  std::vector<std::size_t> write_calls_;
};

}  // namespace trigmesh::test_support
