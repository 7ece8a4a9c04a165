#include "tests/support/demo_session.hpp"

#include <algorithm>
#include <utility>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "sfm/exchange/camera_profile.hpp"

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxPictureBytes = std::size_t{16} << 20U;

fs::path demo() {
  return fs::path(TRIGMESH_SOURCE_DIR) / "tools/demo/courtyard";
}

/// Tests cannot go on without it.
template <typename Value>
Value needed(Result<Value> result) {
  TM_CHECK(result.has_value());
  return std::move(*result);
}

}  // namespace

fs::path demo_camera_file() {
  return demo() / "gt/cameras.txt";
}

std::string demo_camera_profile() {
  return needed(format_camera_profile(needed(read_camera_file(demo_camera_file())).front()));
}

std::vector<std::vector<std::uint8_t>> demo_pictures(std::size_t step) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(demo() / "images")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::vector<std::uint8_t>> pictures;
  for (std::size_t i = 0; i < files.size(); i += step) {
    pictures.push_back(needed(read_file_bytes(files[i], kMaxPictureBytes)));
  }
  return pictures;
}

DemoStore::DemoStore() {
  reopen();
}

void DemoStore::reopen() {
  StoreOptions options;
  options.root = temporary_.path() / "sessions";
  options.software_version = "test";
  store_.emplace(needed(SessionStore::open(real_file_system(), clock_, wall_clock_, options)));
}

std::string DemoStore::add(const std::vector<std::vector<std::uint8_t>>& pictures,
                           const std::string& camera_profile) {
  NewSession what;
  what.mode = "still";
  what.camera_profile = camera_profile;
  Session session = needed(store_->create(what));
  std::uint64_t sequence = 0;
  for (const std::vector<std::uint8_t>& picture : pictures) {
    FrameMetadata metadata;
    metadata.timestamp = std::chrono::milliseconds(100 * ++sequence);
    metadata.sensor_sequence = sequence;
    TM_CHECK(session.add_frame(picture, metadata).has_value());
  }
  TM_CHECK(session.close("test").has_value());
  return session.manifest().id;
}

Session DemoStore::open(const std::string& id) {
  return std::move(needed(store_->open_session(id)).session);
}

}  // namespace trigmesh::test_support
