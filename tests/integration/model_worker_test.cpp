// Models of sessions: the same as the command line makes, also when the program was killed.

#include "firmware/daemon/model_worker.hpp"

#include <csignal>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/integration/run_program.hpp"
#include "tests/support/demo_session.hpp"

namespace trigmesh::test_support {
namespace {

constexpr std::size_t kStep = 4;
constexpr std::size_t kPictures = 5;
constexpr std::chrono::seconds kTimeLimit{100};

ModelWorkerOptions options_with(int threads) {
  ReconstructionSettings settings;
  settings.preset = ReconstructionSettings::Preset::kPreview;
  settings.threads = threads;
  settings.seed = 3;
  return model_worker_options(settings, ScaleSettings{}, TRIGMESH_VERSION);
}

/// Makes the model of a session. The process ends like in a power cut when `killed_at` begins.
ModelAnswer make_model(Session session, int threads, std::optional<Stage> killed_at = {}) {
  const SteadyClock clock;
  std::promise<ModelAnswer> answered;
  auto answer = answered.get_future();
  ModelWorker worker(options_with(threads),
                     clock,
                     {.on_answer = [&](const ModelAnswer& told) { answered.set_value(told); },
                      .on_progress =
                          [&](const std::string& /*session*/, const Progress& progress) {
                            if (progress.stage == killed_at) {
                              (void)::kill(::getpid(), SIGKILL);
                            }
                          },
                      .on_followed = {}});
  worker.begin(std::move(session));
  return answer.get();
}

/// The same in a process of its own, which does not survive it.
void be_killed(DemoStore& store, const std::string& id, Stage stage) {
  const pid_t child = ::fork();
  if (child == 0) {
    (void)make_model(store.open(id), 2, stage);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status)) << "the stage was never reached";
}

std::vector<std::vector<std::uint8_t>> few_pictures() {
  auto pictures = demo_pictures(kStep);
  pictures.resize(kPictures);
  return pictures;
}

TEST(ModelOfASession, IsWhatTheCommandLineMakes) {
  DemoStore store;
  const TemporaryFolder output;
  const std::string id = store.add(few_pictures(), demo_camera_profile());
  const ModelAnswer answer = make_model(store.open(id), 2);
  ASSERT_EQ(answer.outcome, ModelOutcome::kReady) << answer.message;
  const ProgramResult result = run_trigmesh({"reconstruct",
                                             store.folder_of(id).string(),
                                             "--output",
                                             output.path().string(),
                                             "--camera",
                                             demo_camera_file().string(),
                                             "--preset",
                                             "preview",
                                             "--seed",
                                             "3",
                                             "--threads",
                                             "1",
                                             "--quiet"},
                                            kTimeLimit);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(all_files(output.path() / "model"), all_files(store.folder_of(id) / "model"));
}

TEST(ModelOfASession, IsTheSameWhenTheProgramIsKilledInAnyStage) {
  DemoStore store;
  const std::string id = store.add(few_pictures(), demo_camera_profile());
  ASSERT_EQ(make_model(store.open(id), 2).outcome, ModelOutcome::kReady);
  const auto expected = all_files(store.folder_of(id) / "model");
  for (const Stage stage : {Stage::kExtract, Stage::kMatch, Stage::kWrite, Stage::kTexture}) {
    SCOPED_TRACE(to_string(stage));
    be_killed(store, id, stage);
    store.reopen();
    EXPECT_EQ(store.open(id).manifest().state, SessionState::kClosed);
    ASSERT_EQ(make_model(store.open(id), 1).outcome, ModelOutcome::kReady);
    EXPECT_EQ(all_files(store.folder_of(id) / "model"), expected);
  }
}

}  // namespace
}  // namespace trigmesh::test_support
