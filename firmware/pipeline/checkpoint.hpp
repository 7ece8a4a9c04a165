#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// Hash of bytes, for naming content: XXH3 64 bit of the library xxhash, chained by `seed`.
[[nodiscard]] std::uint64_t content_hash(std::span<const std::uint8_t> bytes,
                                         std::uint64_t seed = 0);
[[nodiscard]] std::uint64_t content_hash(std::string_view text, std::uint64_t seed = 0);

/// Finished pieces of work on disk, so that an interrupted reconstruction goes on where it stopped.
/// A piece is stored under a name with the key of everything that it was made from; it is given
/// back only for the same key and when its checksum holds, so a stale, torn or damaged file is
/// simply work to be done again. Thread-safe for different names.
class CheckpointFolder {
 public:
  /// Makes the folder if it is missing. kIo, kNoSpace.
  [[nodiscard]] static Result<CheckpointFolder> open(const std::filesystem::path& folder);

  [[nodiscard]] Result<> save(const std::string& name,
                              std::uint64_t key,
                              std::span<const std::uint8_t> payload) const;
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> load(const std::string& name,
                                                              std::uint64_t key) const;

  /// Removes the folder with everything in it.
  void discard() const;

 private:
  explicit CheckpointFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path folder_;
};

}  // namespace trigmesh
