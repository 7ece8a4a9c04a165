#include "tests/integration/session_script.hpp"

#include <fstream>
#include <sstream>

#include "firmware/base/atomic_files.hpp"
#include "tests/support/manual_clock.hpp"

namespace trigmesh::test_support {
namespace {

constexpr std::uint32_t kFrames = 12;
constexpr std::uint32_t kUndoAfter = 7;

FrameMetadata metadata_of(std::uint32_t number) {
  FrameMetadata metadata;
  metadata.timestamp = std::chrono::milliseconds(100 * number);
  metadata.gain = 1.5;
  metadata.sensor_sequence = number;
  return metadata;
}

/// Opens the session again when its journal cannot be written any more.
void repair(SessionStore& store, Session& session) {
  if (session.is_broken()) {
    if (auto opened = store.open_session(session.manifest().id)) {
      session = std::move(opened->session);
    }
  }
}

void undo(Session& session, const Promises& promises) {
  if (session.frames().empty()) {
    return;
  }
  const std::uint32_t number = session.frames().back().number;
  promises.add("undoing", number);
  if (session.undo_last_frame()) {
    promises.add("undone", number);
  }
}

void capture(SessionStore& store, Session& session, const Promises& promises) {
  for (std::uint32_t i = 1; i <= kFrames; ++i) {
    (void)session.record(EdgeRecord{EdgeDirection::kPress, std::chrono::milliseconds(100 * i)});
    // The number is part of the picture, and known only afterwards: the next one is tried.
    const std::uint32_t shown = i;
    if (const auto number = session.add_frame(picture(shown), metadata_of(shown))) {
      promises.add("kept", *number);
      promises.add("shows", shown);
    }
    repair(store, session);
    if (i == kUndoAfter) {
      undo(session, promises);
      repair(store, session);
    }
  }
}

Result<> write_model_files(FileSystem& files, const Session& session, std::uint32_t version) {
  const std::filesystem::path staged = session.staged_model();
  if (Result<> made = make_directory(files, staged / "sparse"); !made) {
    return made;
  }
  for (const std::string& name : model_file_names()) {
    // Without fsync: making the model safe is the store's work.
    if (Result<> written = write_file_atomically(
            files, staged / name, std::to_string(version), Durability::kCache);
        !written) {
      return written;
    }
  }
  return {};
}

void make_model(FileSystem& files,
                SessionStore& store,
                Session& session,
                const Promises& promises,
                std::uint32_t version) {
  if (!session.set_state(SessionState::kReconstructing, "test")) {
    repair(store, session);
  }
  (void)write_file_atomically(files, session.work_folder() / "piece", "done", Durability::kCache);
  // First a part of it, then all; readers tell by the version.
  for (const std::uint32_t published : {2 * version - 1, 2 * version}) {
    if (!write_model_files(files, session, published)) {
      return;
    }
    if (session.publish_model()) {
      promises.add("model", published);
    }
    repair(store, session);
  }
  if (session.set_state(SessionState::kModelReady, "test")) {
    promises.add("ready", version);
    (void)session.discard_work();
  }
  repair(store, session);
}

}  // namespace

void Promises::add(const std::string& what, std::uint32_t number) const {
  std::ofstream(path_, std::ios::app) << what << ' ' << number << std::endl;
}

std::vector<std::uint32_t> Promises::all(const std::string& what) const {
  std::ifstream in(path_);
  std::vector<std::uint32_t> numbers;
  std::string word;
  std::uint32_t number = 0;
  while (in >> word >> number) {
    if (word == what) {
      numbers.push_back(number);
    }
  }
  return numbers;
}

std::vector<std::uint8_t> picture(std::uint32_t number) {
  std::vector<std::uint8_t> bytes(100 + number);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::uint8_t>(i * 7 + number);
  }
  return bytes;
}

const std::vector<std::string>& model_file_names() {
  static const std::vector<std::string> names = {"sparse/images.txt", "sparse.ply", "report.json"};
  return names;
}

StoreOptions script_options(const std::filesystem::path& root) {
  StoreOptions options;
  options.root = root;
  options.software_version = "test";
  return options;
}

void run_session_script(FileSystem& files,
                        const std::filesystem::path& root,
                        const Promises& promises) {
  const ManualClock clock;
  const ManualWallClock wall_clock;
  auto store = SessionStore::open(files, clock, wall_clock, script_options(root));
  if (!store) {
    return;
  }
  auto session = store->create({"still", "", "[capture]\n", 1, 2});
  if (!session) {
    return;
  }
  capture(*store, *session, promises);
  if (!session->close("long press")) {
    repair(*store, *session);
    (void)session->close("again");  // a full disk stays full; the next start closes it
  }
  make_model(files, *store, *session, promises, 1);
  make_model(files, *store, *session, promises, 2);
}

}  // namespace trigmesh::test_support
