#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// An open file of a FileSystem, which outlives it; closed when it goes. Errors name the path.
/// Thread-compatible.
class File {
 public:
  /// kNotFound, kNoSpace, kIo.
  [[nodiscard]] static Result<File> open(FileSystem& files,
                                         const std::filesystem::path& path,
                                         OpenMode mode);

  File(const File&) = delete;
  File& operator=(const File&) = delete;
  File(File&& other) noexcept;
  File& operator=(File&& other) noexcept;
  ~File();

  /// All bytes, however many calls it takes. After an error some of them may be written.
  [[nodiscard]] Result<> write(std::string_view bytes);
  /// How many bytes came, 0 at the end.
  [[nodiscard]] Result<std::size_t> read(std::span<char> room);
  [[nodiscard]] Result<> sync();
  [[nodiscard]] Result<> truncate(std::uint64_t size_bytes);
  /// Makes the next read come from the device, where the kernel can.
  [[nodiscard]] Result<> forget_cached();
  /// Tells of a delayed write error. No other call may follow.
  [[nodiscard]] Result<> close();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  File(FileSystem& files, std::filesystem::path path, int fd)
      : files_(&files), path_(std::move(path)), fd_(fd) {}

  FileSystem* files_;
  std::filesystem::path path_;
  int fd_;
};

}  // namespace trigmesh
