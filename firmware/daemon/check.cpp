#include "firmware/daemon/check.hpp"

#include <fmt/format.h>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/daemon/backends.hpp"
#include "firmware/session/layout.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kMaxProfileBytes = std::size_t{64} << 10U;

Result<> check_root(FileSystem& files, const std::filesystem::path& root) {
  TM_RETURN_IF_ERROR(make_directory(files, root));
  const std::filesystem::path file = root / fmt::format("{}check", kNewPrefix);
  TM_RETURN_IF_ERROR(write_file_atomically(files, file, "writable\n"));
  return remove_tree(files, file);
}

}  // namespace

Result<std::string> read_profile(const Settings& settings) {
  if (settings.camera.profile.empty()) {
    return std::string();
  }
  return read_file(settings.camera.profile, kMaxProfileBytes);
}

std::vector<std::string> unusable_now(const Settings& settings,
                                      FileSystem& files,
                                      const Clock& clock) {
  std::vector<std::string> sentences;
  if (const auto profile = read_profile(settings); !profile) {
    sentences.push_back(fmt::format("profile: {}", profile.error().message));
  }
  if (const auto root = check_root(files, settings.storage.root); !root) {
    sentences.push_back(fmt::format("storage: {}", root.error().message));
  }
  for (std::string& sentence : unusable_devices(settings, clock)) {
    sentences.push_back(std::move(sentence));
  }
  return sentences;
}

}  // namespace trigmesh
