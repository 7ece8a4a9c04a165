#include "firmware/daemon/model_worker.hpp"

#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <sys/resource.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/demo_session.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using test_support::demo_camera_profile;
using test_support::demo_pictures;
using test_support::DemoStore;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

/// Five pictures, enough for a model.
constexpr std::size_t kStep = 4;
constexpr std::size_t kPictures = 5;

std::vector<std::vector<std::uint8_t>> few_pictures() {
  auto pictures = demo_pictures(kStep);
  pictures.resize(kPictures);
  return pictures;
}

ModelWorkerOptions quick_options(const ScaleSettings& scale = {}) {
  ReconstructionSettings settings;
  settings.preset = ReconstructionSettings::Preset::kPreview;
  settings.threads = 2;
  ModelWorkerOptions options = model_worker_options(settings, scale, "test");
  options.reconstruction.features.upsample = false;
  options.reconstruction.build.texture_size_px = 512;
  return options;
}

std::string contents(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Every file of a model by its name.
std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[entry.path().lexically_relative(folder).string()] = contents(entry.path());
    }
  }
  return files;
}

ModelListeners listening(std::function<void(const ModelAnswer&)> on_answer) {
  return {.on_answer = std::move(on_answer), .on_progress = {}, .on_followed = {}};
}

/// A worker that is asked to stop when a stage begins, if one is given.
class Work {
 public:
  explicit Work(const ModelWorkerOptions& options = quick_options(),
                std::optional<Stage> stop_at = {})
      : stop_at_(stop_at),
        worker_(options,
                clock_,
                {.on_answer = [this](const ModelAnswer& answer) { answered_.set_value(answer); },
                 .on_progress =
                     [this](const std::string& /*session*/, const Progress& progress) {
                       if (progress.stage == stop_at_) {
                         worker_.request_stop();
                       }
                     },
                 .on_followed = {}}) {}

  ModelAnswer make(Session session) {
    answered_ = {};
    auto answer = answered_.get_future();
    worker_.begin(std::move(session));
    return answer.get();
  }

  [[nodiscard]] const ModelWorker& worker() const { return worker_; }

 private:
  const SteadyClock clock_;
  const std::optional<Stage> stop_at_;
  std::promise<ModelAnswer> answered_;
  ModelWorker worker_;
};

TEST(ModelWorker, MakesTheModelOfASession) {
  DemoStore store;
  const std::string id = store.add(few_pictures(), demo_camera_profile());
  Work work;
  const ModelAnswer answer = work.make(store.open(id));
  EXPECT_EQ(answer.session_id, id);
  EXPECT_EQ(answer.outcome, ModelOutcome::kReady) << answer.message;
  EXPECT_THAT(answer.message, ContainsRegex("eady: .* of the surface|Ready: the surface"))
      << "whether more is to be shot";
  EXPECT_GT(work.worker().progress_count(), 100U);
  const Session session = store.open(id);
  EXPECT_EQ(session.manifest().state, SessionState::kModelReady);
  for (const char* file : {"sparse/images.txt", "sparse.ply", "mesh.ply", "textured.glb"}) {
    EXPECT_GT(fs::file_size(session.model() / file), 100U) << file;
  }
  EXPECT_THAT(contents(session.model() / "sparse/images.txt"), HasSubstr("000001.jpg"));
  EXPECT_FALSE(fs::exists(session.work_folder()));
  EXPECT_FALSE(fs::exists(session.staged_model()));
}

TEST(ModelWorkerSlow, MakesAModelInMetresOffTheMarkersOfTheSettings) {
  DemoStore store;
  ScaleSettings scale;
  scale.marker_side_m = 0.1;
  const std::string id = store.add(few_pictures(), demo_camera_profile());
  const ModelAnswer answer = Work(quick_options(scale)).make(store.open(id));
  EXPECT_EQ(answer.outcome, ModelOutcome::kReady) << answer.message;
  EXPECT_THAT(contents(store.open(id).model() / "report.json"), HasSubstr("\"unit\": \"metre\""));

  scale.marker_sides_m[0] = 0.2;
  const std::string wrong = store.add(few_pictures(), demo_camera_profile());
  const ModelAnswer told = Work(quick_options(scale)).make(store.open(wrong));
  EXPECT_EQ(told.outcome, ModelOutcome::kReady);
  EXPECT_THAT(told.message, HasSubstr("It has no scale: the known lengths disagree"));
}

TEST(ModelWorkerSlow, GivesTheSameBytesAfterAStopInAnyStage) {
  DemoStore store;
  const auto pictures = few_pictures();
  const std::string whole = store.add(pictures, demo_camera_profile());
  ASSERT_EQ(Work().make(store.open(whole)).outcome, ModelOutcome::kReady);
  auto expected = files_of(store.open(whole).model());
  for (const Stage stage : {Stage::kExtract, Stage::kMatch, Stage::kMap, Stage::kTexture}) {
    SCOPED_TRACE(to_string(stage));
    const std::string id = store.add(pictures, demo_camera_profile());
    const ModelAnswer stopped = Work(quick_options(), stage).make(store.open(id));
    EXPECT_EQ(stopped.outcome, ModelOutcome::kCancelled) << stopped.message;
    const Session after = store.open(id);
    EXPECT_EQ(after.manifest().state, SessionState::kClosed);
    EXPECT_TRUE(fs::exists(after.work_folder())) << "finished pieces are kept";
    ASSERT_EQ(Work().make(store.open(id)).outcome, ModelOutcome::kReady);
    auto made = files_of(after.model());
    // The reports name the session, the rest is the same.
    for (const char* report : {"report.json", "report.html"}) {
      EXPECT_THAT(made[report], HasSubstr(id));
      made.erase(report);
      expected.erase(report);
    }
    EXPECT_EQ(made, expected);
  }
}

TEST(ModelWorker, SaysWhyPicturesGiveNoModelInAReport) {
  DemoStore store;
  auto pictures = few_pictures();
  pictures.resize(1);
  const std::string id = store.add(pictures, demo_camera_profile());
  const ModelAnswer answer = Work().make(store.open(id));
  EXPECT_EQ(answer.outcome, ModelOutcome::kNone);
  EXPECT_FALSE(answer.message.empty());
  const Session session = store.open(id);
  EXPECT_EQ(session.manifest().state, SessionState::kModelFailed);
  EXPECT_TRUE(fs::exists(session.model() / "report.html"));
  EXPECT_FALSE(fs::exists(session.model() / "sparse"));
  EXPECT_FALSE(fs::exists(session.work_folder()));
}

TEST(ModelWorker, PicturesThatAreNoneGiveNoModel) {
  DemoStore store;
  const std::string id = store.add({{1, 2, 3}, {4, 5, 6}}, "");
  EXPECT_EQ(Work().make(store.open(id)).outcome, ModelOutcome::kNone);
  EXPECT_EQ(store.open(id).manifest().state, SessionState::kModelFailed);
}

TEST(ModelWorker, TellsWorkThatCannotBeDone) {
  DemoStore store;
  const std::string id = store.add(few_pictures(), "no profile");
  Work work;
  const ModelAnswer answer = work.make(store.open(id));
  EXPECT_EQ(answer.outcome, ModelOutcome::kFailed);
  EXPECT_THAT(answer.message, HasSubstr(id));
  EXPECT_EQ(store.open(id).manifest().state, SessionState::kModelFailed);
  const std::string next = store.add(few_pictures(), demo_camera_profile());
  EXPECT_EQ(work.make(store.open(next)).outcome, ModelOutcome::kReady) << "the worker goes on";
}

TEST(ModelWorker, LooksAtAStopThatCameBeforeItBegan) {
  DemoStore store;
  const std::string id = store.add(few_pictures(), demo_camera_profile());
  const SteadyClock clock;
  std::promise<ModelAnswer> answered;
  {
    ModelWorker worker(quick_options(), clock, listening([&](const ModelAnswer& answer) {
                         answered.set_value(answer);
                       }));
    worker.request_stop();  // nothing: idle
    worker.begin(store.open(id));
    worker.request_stop();
  }
  EXPECT_EQ(answered.get_future().get().outcome, ModelOutcome::kCancelled);
}

TEST(ModelWorker, EndingTheWorkerCancelsAndAnswers) {
  DemoStore store;
  const std::string id = store.add(few_pictures(), demo_camera_profile());
  const SteadyClock clock;
  std::promise<ModelAnswer> answered;
  {
    ModelWorker worker(quick_options(), clock, listening([&](const ModelAnswer& answer) {
                         answered.set_value(answer);
                       }));
    worker.begin(store.open(id));
  }
  EXPECT_EQ(answered.get_future().get().outcome, ModelOutcome::kCancelled);
  EXPECT_EQ(store.open(id).manifest().state, SessionState::kClosed);
}

TEST(ModelWorker, WorksWithLessPriorityThanItsMaker) {
  DemoStore store;
  const std::string id = store.add(few_pictures(), demo_camera_profile());
  ModelWorkerOptions options = quick_options();
  options.nice = 17;
  const SteadyClock clock;
  std::promise<int> seen;
  bool told = false;
  std::promise<void> done;
  ModelWorker worker(
      options,
      clock,
      {.on_answer = [&](const ModelAnswer&) { done.set_value(); },
       .on_progress =
           [&](const std::string&, const Progress& progress) {
             // The first word comes from the worker's own thread, before others begin.
             if (progress.stage == Stage::kMap && !std::exchange(told, true)) {
               seen.set_value(::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())));
             }
           },
       .on_followed = {}});
  worker.begin(store.open(id));
  EXPECT_EQ(seen.get_future().get(), 17);
  EXPECT_LT(::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())), 17);
  worker.request_stop();
  done.get_future().get();
}

TEST(ModelWorkerOptions, FollowTheSettings) {
  ReconstructionSettings settings;
  settings.preset = ReconstructionSettings::Preset::kFine;
  settings.memory_limit_mb = 3;
  settings.threads = 5;
  settings.priority = 19;
  settings.seed = 7;
  const ModelWorkerOptions options = model_worker_options(settings, ScaleSettings{}, "1.2");
  EXPECT_TRUE(options.validate());
  EXPECT_EQ(options.nice, 19);
  EXPECT_EQ(options.reconstruction.build.preset, QualityPreset::kFine);
  EXPECT_EQ(options.reconstruction.memory_limit_bytes, 3'000'000U);
  EXPECT_EQ(options.reconstruction.num_threads, 5);
  EXPECT_EQ(options.reconstruction.seed, 7U);
  EXPECT_EQ(options.reconstruction.software_version, "1.2");
  settings.threads = 0;
  EXPECT_GE(model_worker_options(settings, ScaleSettings{}, "").reconstruction.num_threads, 1);
  EXPECT_FALSE(options.reconstruction.scale.known.any());
  const ModelWorkerOptions too_nice{.reconstruction = {}, .nice = 20};
  EXPECT_FALSE(too_nice.validate());
}

TEST(ModelWorkerOptions, KnowTheMarkersOfTheSettings) {
  ScaleSettings scale;
  scale.dictionary = ScaleSettings::Dictionary::kBits5Of250;
  scale.marker_side_m = 0.1;
  scale.marker_sides_m = {{249, 0.2}};
  scale.marker_distances_m = {{{0, 1}, 0.5}};
  scale.up = ScaleSettings::Up::kCard;
  const ModelWorkerOptions options = model_worker_options({}, scale, "");
  EXPECT_TRUE(options.validate());
  const ScaleOptions& known = options.reconstruction.scale;
  EXPECT_EQ(to_string(known.dictionary), "5x5_250");
  EXPECT_EQ(known.known.side_m(3), 0.1);
  EXPECT_EQ(known.known.side_m(249), 0.2);
  EXPECT_EQ(known.known.distance_m.at({0, 1}), 0.5);
  EXPECT_EQ(known.up, UpSource::kCard);
}

}  // namespace
}  // namespace trigmesh
