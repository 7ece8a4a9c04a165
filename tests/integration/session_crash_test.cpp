#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/session/store.hpp"
#include "tests/integration/session_script.hpp"
#include "tests/support/faulty_file_system.hpp"
#include "tests/support/manual_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using test_support::Fault;
using test_support::FaultKind;
using test_support::FaultyFileSystem;
using test_support::Promises;

std::string to_string(const Fault& fault) {
  return fmt::format("fault {} (errno {}) at call {}",
                     static_cast<int>(fault.kind),
                     fault.error_number,
                     fault.at_call);
}

/// A store in a folder of its own, and what was promised about it.
struct Scene {
  test_support::TemporaryFolder temporary{test_support::folder_in_memory()};
  fs::path root = temporary.path() / "sessions";
  fs::path aside = temporary.path() / "aside";
  Promises promises{temporary.path() / "promises"};

  Scene() { fs::create_directory(aside); }
};

/// Calls `work` in a process of its own, which the fault may end. Whether it was ended.
template <typename Work>
bool ended_by_fault(const Work& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    work();
    ::_exit(0);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  const int code = WEXITSTATUS(status);
  EXPECT_TRUE(code == 0 || code == test_support::kKilledExitCode) << code;
  return code == test_support::kKilledExitCode;
}

/// The calls of the script at which there is something to cut or fail, from 1.
std::vector<std::size_t> points_of_script(FaultKind kind) {
  const Scene scene;
  FaultyFileSystem files;
  test_support::run_session_script(files, scene.root, scene.promises);
  EXPECT_EQ(scene.promises.all("kept").size(), 12U);
  EXPECT_EQ(scene.promises.all("model").size(), 4U);
  EXPECT_EQ(scene.promises.all("ready").size(), 2U);
  if (kind == FaultKind::kTornWriteKill || kind == FaultKind::kShortThenFail ||
      kind == FaultKind::kShortWrite) {
    return files.write_calls();
  }
  std::vector<std::size_t> calls(files.calls());
  std::iota(calls.begin(), calls.end(), std::size_t{1});
  return calls;
}

/// Finished pieces of a model that is still to be made are none.
bool has_leftovers(const fs::path& root) {
  return std::any_of(fs::recursive_directory_iterator(root),
                     fs::recursive_directory_iterator(),
                     [](const fs::directory_entry& entry) {
                       const std::string name = entry.path().filename().string();
                       const bool is_work =
                           entry.path().string().find("/.work") != std::string::npos;
                       return !is_work && (name.starts_with('.') || name.ends_with(".old"));
                     });
}

/// Frames that must be there: acknowledged, and nobody asked to discard them.
void expect_frames_kept(const Session& session, const Promises& promises) {
  const std::vector<std::uint32_t> kept = promises.all("kept");
  const std::vector<std::uint32_t> shows = promises.all("shows");
  const std::vector<std::uint32_t> undoing = promises.all("undoing");
  const std::vector<std::uint32_t> undone = promises.all("undone");
  std::set<std::uint32_t> found;
  for (const FrameKept& frame : session.frames()) {
    found.insert(frame.number);
  }
  for (std::size_t i = 0; i < shows.size(); ++i) {
    if (std::count(undoing.begin(), undoing.end(), kept[i]) == 0) {
      EXPECT_TRUE(found.contains(kept[i])) << "acknowledged frame " << kept[i] << " is lost";
      const auto bytes = read_file_bytes(session.frame_path(kept[i]), 10'000);
      ASSERT_TRUE(bytes) << bytes.error().message;
      EXPECT_EQ(*bytes, test_support::picture(shows[i]));
    }
  }
  for (const std::uint32_t number : undone) {
    EXPECT_FALSE(found.contains(number)) << "discarded frame " << number << " is back";
    EXPECT_FALSE(fs::exists(session.frame_path(number)));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(session.folder() / "frames"), {}),
            static_cast<std::ptrdiff_t>(session.frames().size()));
}

/// No model, or one whose files are all there and all of one version, not older than promised.
void expect_whole_model(const fs::path& session, const Promises& promises) {
  const std::vector<std::uint32_t> promised = promises.all("model");
  const fs::path model = session / "model";
  if (!fs::exists(model)) {
    EXPECT_TRUE(promised.empty()) << "the model is lost";
    return;
  }
  std::set<std::string> versions;
  for (const std::string& name : test_support::model_file_names()) {
    versions.insert(read_file(model / name, 100).value_or("missing: " + name));
  }
  ASSERT_EQ(versions.size(), 1U) << "half a model is visible";
  EXPECT_GE(*versions.begin(), std::to_string(promised.empty() ? 1 : promised.back()));
}

/// The state that was promised last, and pieces of a model only where it is still to be made.
void expect_model_goes_on(const Session& session, const Promises& promises) {
  const SessionState state = session.manifest().state;
  EXPECT_NE(state, SessionState::kReconstructing) << "nobody makes it";
  if (promises.all("ready").size() == 2) {
    EXPECT_EQ(state, SessionState::kModelReady);
  }
  if (state == SessionState::kModelReady) {
    EXPECT_FALSE(fs::exists(session.work_folder()));
    EXPECT_TRUE(fs::exists(session.model()));
  }
}

/// Starts the program again, as after a crash, and looks at everything. The time that it took.
std::chrono::nanoseconds expect_nothing_lost(const Scene& scene) {
  FaultyFileSystem files;
  const test_support::ManualClock clock;
  const test_support::ManualWallClock wall_clock;
  const auto options = test_support::script_options(scene.root);
  const auto begin = std::chrono::steady_clock::now();
  auto store = SessionStore::open(files, clock, wall_clock, options);
  const auto duration = std::chrono::steady_clock::now() - begin;
  EXPECT_TRUE(store) << store.error().message;
  EXPECT_TRUE(store->recovery().unreadable.empty());
  EXPECT_FALSE(has_leftovers(scene.root));
  const auto sessions = store->list().value();
  EXPECT_TRUE(!sessions.empty() || scene.promises.all("kept").empty());
  EXPECT_LE(sessions.size(), 1U);
  for (const SessionInfo& info : sessions) {
    EXPECT_NE(info.manifest.state, SessionState::kCapturing);
    auto opened = store->open_session(info.manifest.id);
    EXPECT_TRUE(opened) << opened.error().message;
    EXPECT_TRUE(opened->recovery.damages.empty()) << "a crash is no damage";
    EXPECT_TRUE(opened->recovery.missing.empty());
    EXPECT_FALSE(opened->recovery.was_open) << "not recovered when the store was opened";
    EXPECT_EQ(opened->session.manifest().state, info.manifest.state);
    expect_frames_kept(opened->session, scene.promises);
    expect_whole_model(opened->session.folder(), scene.promises);
    expect_model_goes_on(opened->session, scene.promises);
    EXPECT_EQ(read_file(opened->session.folder() / "frames.csv", 10'000).value_or("missing"),
              render_frame_table(opened->session.frames()));
  }
  EXPECT_TRUE(store->create({"still", "", "", 1, 3})) << "the rig must go on";
  return duration;
}

struct Tally {
  std::size_t points = 0;
  std::size_t ended = 0;
  std::chrono::nanoseconds longest_recovery{};
};

void run_point(const Fault& fault, Tally& tally) {
  SCOPED_TRACE(to_string(fault));
  const Scene scene;
  ++tally.points;
  tally.ended += ended_by_fault([&] {
    FaultyFileSystem files(fault, scene.aside);
    test_support::run_session_script(files, scene.root, scene.promises);
  });
  tally.longest_recovery = std::max(tally.longest_recovery, expect_nothing_lost(scene));
}

void run_all_points(FaultKind kind, int error_number) {
  Tally tally;
  for (const std::size_t call : points_of_script(kind)) {
    run_point({kind, call, error_number}, tally);
    ASSERT_FALSE(testing::Test::HasFailure());
  }
  fmt::print("{} points, {} ended the process, longest recovery {:.1f} ms\n",
             tally.points,
             tally.ended,
             std::chrono::duration<double, std::milli>(tally.longest_recovery).count());
}

TEST(SessionCrash, LosesNothingWhenKilledAtAnySystemCall) {
  run_all_points(FaultKind::kKill, 0);
}

TEST(SessionCrash, LosesNothingWhenAWriteIsCutByTheEnd) {
  run_all_points(FaultKind::kTornWriteKill, 0);
}

TEST(SessionCrash, LosesNothingInAPowerCutThatTakesAllThatWasNotSynced) {
  run_all_points(FaultKind::kPowerCut, 0);
}

TEST(SessionCrash, LosesNothingInAPowerCutThatTakesSomeOfIt) {
  run_all_points(FaultKind::kPowerCutPartly, 0);
}

TEST(SessionCrash, LosesNothingWhenAnyCallFails) {
  run_all_points(FaultKind::kFail, EIO);
}

TEST(SessionCrash, LosesNothingWhenTheDiskIsFullOnceAtAnyCall) {
  run_all_points(FaultKind::kFail, ENOSPC);
}

TEST(SessionCrash, LosesNothingWhenTheDiskStaysFullFromAnyCallOn) {
  run_all_points(FaultKind::kFailFromThere, ENOSPC);
}

TEST(SessionCrash, LosesNothingWhenAnyWriteIsShortAndThenFails) {
  run_all_points(FaultKind::kShortThenFail, ENOSPC);
}

TEST(SessionCrash, LosesNothingWhenAnyWriteIsShort) {
  run_all_points(FaultKind::kShortWrite, 0);
}

/// The recovery itself is cut at each of its calls, after crashes at places all over the script.
TEST(SessionCrash, LosesNothingWhenRecoveryIsCutToo) {
  constexpr std::size_t kStride = 23;
  const std::size_t calls = points_of_script(FaultKind::kPowerCut).size();
  std::size_t points = 0;
  for (std::size_t first = 1; first <= calls && !HasFailure(); first += kStride) {
    bool ended = true;
    for (std::size_t second = 1; ended && !HasFailure(); second += 2, ++points) {
      SCOPED_TRACE(fmt::format("cut at {}, recovery cut at {}", first, second));
      const Scene scene;
      ended_by_fault([&] {
        FaultyFileSystem files({FaultKind::kPowerCut, first, 0}, scene.aside);
        test_support::run_session_script(files, scene.root, scene.promises);
      });
      ended = ended_by_fault([&] {
        FaultyFileSystem files({FaultKind::kPowerCut, second, 0}, scene.aside);
        const test_support::ManualClock clock;
        const test_support::ManualWallClock wall_clock;
        (void)SessionStore::open(
            files, clock, wall_clock, test_support::script_options(scene.root));
      });
      (void)expect_nothing_lost(scene);
    }
  }
  fmt::print("{} points\n", points);
}

}  // namespace
}  // namespace trigmesh
