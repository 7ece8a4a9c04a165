#include "firmware/pipeline/checkpoint.hpp"

#include <cstring>
#include <system_error>

#include <xxhash.h>

#include "firmware/base/binary_stream.hpp"
#include "firmware/base/check.hpp"
#include "sfm/exchange/file_io.hpp"

namespace trigmesh {

namespace {

// "TMCP", raised with every change of what checkpoints hold.
constexpr std::uint32_t kMagic = 0x50434D54;
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kMaxCheckpointBytes = std::size_t{1} << 32U;

struct Header {
  std::uint32_t magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint64_t key = 0;
  std::uint64_t checksum = 0;
};

}  // namespace

std::uint64_t content_hash(std::span<const std::uint8_t> bytes, std::uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}

std::uint64_t content_hash(std::string_view text, std::uint64_t seed) {
  return XXH3_64bits_withSeed(text.data(), text.size(), seed);
}

Result<CheckpointFolder> CheckpointFolder::open(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    const ErrorCode code =
        error == std::errc::no_space_on_device ? ErrorCode::kNoSpace : ErrorCode::kIo;
    return fail(code, "cannot make the work folder {}: {}", folder.string(), error.message());
  }
  return CheckpointFolder(folder);
}

Result<> CheckpointFolder::save(const std::string& name,
                                std::uint64_t key,
                                std::span<const std::uint8_t> payload) const {
  const Header header{.key = key, .checksum = content_hash(payload)};
  std::string bytes(sizeof(header) + payload.size(), '\0');
  std::memcpy(bytes.data(), &header, sizeof(header));
  if (!payload.empty()) {
    std::memcpy(bytes.data() + sizeof(header), payload.data(), payload.size());
  }
  return write_file_atomically(folder_ / name, bytes, Durability::kCache);
}

std::optional<std::vector<std::uint8_t>> CheckpointFolder::load(const std::string& name,
                                                                std::uint64_t key) const {
  const auto bytes = read_file(folder_ / name, kMaxCheckpointBytes);
  Header header;
  if (!bytes || bytes->size() < sizeof(header)) {
    return std::nullopt;
  }
  std::memcpy(&header, bytes->data(), sizeof(header));
  if (header.magic != kMagic || header.version != kVersion || header.key != key) {
    return std::nullopt;
  }
  std::vector<std::uint8_t> payload(bytes->begin() + sizeof(header), bytes->end());
  if (content_hash(payload) != header.checksum) {
    return std::nullopt;
  }
  return payload;
}

void CheckpointFolder::discard() const {
  std::error_code ignored;  // what cannot be removed costs only space
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace trigmesh
