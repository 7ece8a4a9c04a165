// The built trigmeshd with the demo recording for a camera, steered through its socket.

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "firmware/control/control_client.hpp"
#include "firmware/session/journal.hpp"
#include "tests/integration/run_program.hpp"
#include "tests/integration/running_service.hpp"

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;

class DaemonProgram : public ScratchTest {
 protected:
  /// Without models, unless `more` begins with another [reconstruction].
  void write_settings(const std::string& more = "") {
    std::ofstream(path("rig.toml"))
        << "[camera]\nbackend = \"replay\"\ndevice = \""
        << source_path("tools/demo/courtyard").string() << "\"\n"
        << "[trigger]\nbackend = \"none\"\n[indicator]\nbackend = \"none\"\n"
        << "[capture]\nevery_nth_sharp_frame = 1\n"
        << "[storage]\nreserve_mb = 10\nwarn_mb = 10\nroot = \"" << path("sessions") << "\"\n"
        << (more.starts_with("[reconstruction]") ? "" : "[reconstruction]\nenabled = false\n")
        << more;
  }

  [[nodiscard]] std::vector<std::string> command(std::vector<std::string> more = {}) const {
    std::vector<std::string> all = {TRIGMESH_DAEMON, "--settings", path("rig.toml")};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  /// Starts it and waits until it is ready.
  void start() {
    ++starts_;
    seen_ = 0;
    service_.emplace(command({"--socket", path("control")}),
                     path("notify" + std::to_string(starts_)),
                     path("log"),
                     std::chrono::seconds(4));
    ASSERT_TRUE(service_->await_told("READY=1")) << contents(path("log"));
  }

  void stop() {
    service_->send_signal(SIGTERM);
    EXPECT_EQ(service_->await_end(), 0) << contents(path("log"));
  }

  [[nodiscard]] ControlClient client() const { return ControlClient({path("control")}); }

  [[nodiscard]] Json get(const std::string& what) const {
    const auto answer = client().get(what);
    EXPECT_TRUE(answer) << answer.error().message;
    return answer ? Json::parse(*answer) : Json();
  }

  void post(const std::string& what) const {
    const auto answer = client().post(what);
    EXPECT_TRUE(answer) << answer.error().message;
  }

  /// Waits for the next event of this kind whose data has `text` in it.
  void await(const std::string& kind, const std::string& text) {
    const auto is_another = [&](const ControlEvent& event) {
      seen_ = event.number;
      return event.kind != kind || event.data.find(text) == std::string::npos;
    };
    const auto watched = client().watch(seen_, is_another, {});
    EXPECT_TRUE(watched) << watched.error().message;
  }

  [[nodiscard]] fs::path only_session() const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(path("sessions"))) {
      found.push_back(entry.path());
    }
    EXPECT_EQ(found.size(), 1U);
    return found.empty() ? fs::path() : found.front();
  }

  std::optional<RunningService> service_;

 private:
  int starts_ = 0;
  std::uint64_t seen_ = 0;  ///< number of the last event
};

TEST_F(DaemonProgram, CapturesASessionWithUntouchedBytes) {
  write_settings();
  start();
  await("camera", "true");
  post("/v1/start");
  await("frame", "\"frames\":5}");
  post("/v1/finish");
  await("phase", "idle");
  const Json sessions = get("/v1/sessions");
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].at("state"), "closed") << contents(path("log"));
  stop();
  std::set<std::string> pictures;
  for (const auto& [name, bytes] : all_files(source_path("tools/demo/courtyard/images"))) {
    pictures.insert(bytes);
  }
  const auto kept = all_files(only_session() / "frames");
  EXPECT_GE(kept.size(), 5U);
  for (const auto& [name, bytes] : kept) {
    EXPECT_TRUE(pictures.contains(bytes)) << name;
  }
}

constexpr const char* kQuickModels =
    "[reconstruction]\npreset = \"preview\"\nthreads = 2\npriority = 0\n";

TEST_F(DaemonProgram, MapsACaptureWhileItGoesOnAndReplayMakesTheSameModel) {
  write_settings(kQuickModels);
  start();
  await("camera", "true");
  post("/v1/start");
  await("map", "tracked");
  await("frame", "\"frames\":14}");
  post("/v1/finish");
  await("model", "ready");
  stop();
  const std::string session = only_session().string();
  const ProgramResult same = run_trigmesh(
      {"replay", session, "--output", path("again"), "--threads", "1", "--quiet", "--verify"},
      std::chrono::seconds(120));
  EXPECT_EQ(same.exit_code, 0) << same.err;
  EXPECT_THAT(same.out, HasSubstr("identical to"));
  // A model that was changed is noticed.
  std::ofstream(fs::path(session) / "model/sparse.ply", std::ios::app) << "x";
  const ProgramResult other =
      run_trigmesh({"replay", session, "--output", path("again"), "--quiet", "--verify"},
                   std::chrono::seconds(120));
  EXPECT_EQ(other.exit_code, 4);
  EXPECT_THAT(other.err, HasSubstr("1 files: sparse.ply"));
}

TEST_F(DaemonProgram, ASessionIsContinuedByCommand) {
  write_settings(kQuickModels);
  start();
  await("camera", "true");
  post("/v1/start");
  await("frame", "\"frames\":8}");
  post("/v1/finish");
  await("model", "\"session\"");
  const std::string id = only_session().filename().string();
  const ProgramResult continued = run_trigmesh({"continue", id, "--socket", path("control")});
  EXPECT_EQ(continued.exit_code, 0) << continued.err;
  await("frame", "\"frames\":14}");
  post("/v1/finish");
  await("model", "ready");
  const ProgramResult unknown =
      run_trigmesh({"continue", "20200101T000000Z-000000", "--socket", path("control")});
  EXPECT_EQ(unknown.exit_code, 3) << unknown.err;
  stop();
  EXPECT_EQ(
      run_trigmesh({"replay", only_session().string(), "-o", path("again"), "--quiet", "--verify"},
                   std::chrono::seconds(120))
          .exit_code,
      0);
}

TEST_F(DaemonProgram, AStillIsAnsweredWhenItIsStored) {
  write_settings("");
  start();
  await("camera", "true");
  post("/v1/still");
  EXPECT_EQ(get("/v1/status").at("frames"), 1);
  stop();
  EXPECT_EQ(all_files(only_session() / "frames").size(), 1U);
}

TEST_F(DaemonProgram, ASignalDuringACaptureClosesTheSession) {
  write_settings();
  start();
  await("camera", "true");
  post("/v1/start");
  await("frame", "\"frames\":2}");
  stop();
  EXPECT_THAT(contents(only_session() / "session.json"), HasSubstr("closed"));
  EXPECT_TRUE(fs::exists(only_session() / "frames.csv"));
}

TEST_F(DaemonProgram, NothingAcknowledgedIsLostWhenItIsKilled) {
  write_settings();
  start();
  await("camera", "true");
  post("/v1/start");
  await("frame", "\"frames\":3}");
  const auto acknowledged = get("/v1/status").at("frames").get<std::size_t>();
  service_->send_signal(SIGKILL);
  EXPECT_EQ(service_->await_end(), 128 + SIGKILL);
  start();
  const Json sessions = get("/v1/sessions");
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0].at("state"), "closed") << "by itself";
  EXPECT_GE(sessions[0].at("frames").get<std::size_t>(), acknowledged);
  EXPECT_GE(all_files(only_session() / "frames").size(), acknowledged);
  stop();
}

TEST_F(DaemonProgram, TellsItsServiceManagerThatItLives) {
  write_settings();
  start();
  EXPECT_TRUE(service_->await_told("WATCHDOG=1"));
  EXPECT_TRUE(service_->await_told("STATUS=ready"));
  service_->send_signal(SIGINT);
  EXPECT_TRUE(service_->await_told("STOPPING=1"));
  EXPECT_EQ(service_->await_end(), 0);
}

TEST_F(DaemonProgram, WrongSettingsAreNamedWithTheirLine) {
  write_settings("[log]\nlevel = \"loud\"\ncolour = 3\n");
  for (const bool checks : {true, false}) {
    const ProgramResult result = run_program(
        command(checks ? std::vector<std::string>{"--check"} : std::vector<std::string>{}));
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr("rig.toml:17: log.level"));
    EXPECT_THAT(result.err, HasSubstr("rig.toml:18: log.colour"));
  }
}

TEST_F(DaemonProgram, ChecksSettingsAndNamesWhatCannotBeUsedNow) {
  write_settings();
  const ProgramResult well = run_program(command({"--check"}));
  EXPECT_EQ(well.exit_code, 0) << well.err;
  EXPECT_THAT(well.out, HasSubstr("the settings are right"));
  std::ofstream(path("rig.toml")) << "[camera]\nprofile = \"/nonexistent/profile.toml\"\n"
                                     "[trigger]\nchip = \"nochip\"\n"
                                     "[storage]\nroot = \"/proc/sessions\"\n";
  const ProgramResult away = run_program(command({"--check"}));
  EXPECT_EQ(away.exit_code, 0);
  EXPECT_THAT(away.out, HasSubstr("warning: profile: "));
  EXPECT_THAT(away.out, HasSubstr("warning: storage: "));
  EXPECT_THAT(away.out, HasSubstr("warning: trigger: "));
  EXPECT_THAT(away.out, HasSubstr("warning: light: "));
}

TEST_F(DaemonProgram, RefusesAWrongCommandLine) {
  const ProgramResult wrong = run_program({TRIGMESH_DAEMON, "--sockets"});
  EXPECT_EQ(wrong.exit_code, 2);
  const ProgramResult help = run_program({TRIGMESH_DAEMON, "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("Exit codes"));
  const ProgramResult missing = run_program({TRIGMESH_DAEMON, "--settings", path("no.toml")});
  EXPECT_EQ(missing.exit_code, 3);
}

TEST_F(DaemonProgram, SaysWhyItCannotStart) {
  write_settings();
  const ProgramResult result = run_program(command({"--socket", "/nonexistent/control"}));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("/nonexistent/control"));
}

}  // namespace
}  // namespace trigmesh::test_support
