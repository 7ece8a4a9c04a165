#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <sys/mount.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "sfm/exchange/image_codec.hpp"
#include "tests/integration/run_program.hpp"

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::chrono::seconds kTimeLimit{100};

void write(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

std::string noise_png(int width_px, int height_px, std::uint64_t seed) {
  cv::Mat image(height_px, width_px, CV_8UC1);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  const auto bytes = encode_png(image);
  return std::string(bytes->begin(), bytes->end());
}

/// Photographs of the demo recording in a folder of the test, and the program at work on them.
class Reconstruct : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    fs::create_directories(path("photos"));
  }

  /// Every `step`-th frame of the demo recording.
  void take_demo_frames(int step) const {
    std::vector<fs::path> frames;
    for (const auto& entry : fs::directory_iterator(demo() / "images")) {
      frames.push_back(entry.path());
    }
    std::sort(frames.begin(), frames.end());
    for (std::size_t i = 0; i < frames.size(); i += static_cast<std::size_t>(step)) {
      fs::copy_file(frames[i], fs::path(path("photos")) / frames[i].filename());
    }
  }

  [[nodiscard]] static fs::path demo() { return source_path("tools/demo/courtyard"); }

  [[nodiscard]] std::vector<std::string> arguments(
      const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"reconstruct",
                                 path("photos"),
                                 "--output",
                                 path("out"),
                                 "--no-upsample",
                                 "--stop-after",
                                 "sparse",
                                 "--camera",
                                 (demo() / "gt/cameras.txt").string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  [[nodiscard]] ProgramResult run(const std::vector<std::string>& more = {}) const {
    return run_trigmesh(arguments(more), kTimeLimit);
  }

  /// Without a camera file, for pictures of any size.
  [[nodiscard]] ProgramResult run_plain(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{
        "reconstruct", path("photos"), "--output", path("out"), "--stop-after", "sparse"};
    all.insert(all.end(), more.begin(), more.end());
    return run_trigmesh(all, kTimeLimit);
  }

  /// "registered" or the reason of refusal in report.json, by image name.
  [[nodiscard]] std::map<std::string, std::string> reasons() const {
    const auto report = nlohmann::json::parse(contents(path("out/model/report.json")));
    std::map<std::string, std::string> found;
    for (const auto& image : report["images"]) {
      found[image["name"]] = image["status"];
    }
    return found;
  }

  [[nodiscard]] std::size_t registered() const {
    const auto found = reasons();
    return static_cast<std::size_t>(
        std::count_if(found.begin(), found.end(), [](const auto& entry) {
          return entry.second == "registered";
        }));
  }
};

TEST_F(Reconstruct, MakesTheWholeModelOfTheDemo) {
  take_demo_frames(4);
  const ProgramResult result = run();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(registered(), 16U);
  for (const char* file : {"model/sparse/cameras.txt",
                           "model/sparse/images.txt",
                           "model/sparse/points3D.txt",
                           "model/projections.txt",
                           "model/sparse.ply",
                           "model/report.json",
                           "model/report.html",
                           "timings.json"}) {
    EXPECT_GT(fs::file_size(path(std::string("out/") + file)), 100U) << file;
  }
  EXPECT_FALSE(fs::exists(path("out/work"))) << "checkpoints stay only while they are needed";
  EXPECT_THAT(result.out, HasSubstr("All 16 images are registered"));
  const ProgramResult score = run_trigmesh({"evaluate",
                                            path("out"),
                                            "--truth",
                                            (demo() / "gt").string(),
                                            "--min-registered",
                                            "16",
                                            "--max-rmse",
                                            "0.003"});
  EXPECT_EQ(score.exit_code, 0) << score.out << score.err;
}

TEST_F(Reconstruct, GivesTheSameBytesForEveryNumberOfThreads) {
  take_demo_frames(6);
  ASSERT_EQ(run({"--threads", "1"}).exit_code, 0);
  const auto one = all_files(path("out/model"));
  ASSERT_EQ(run({"--threads", "3"}).exit_code, 0);
  EXPECT_EQ(all_files(path("out/model")), one);
}

TEST_F(Reconstruct, GoesOnWhereItWasInterrupted) {
  take_demo_frames(6);
  ASSERT_EQ(run({"--threads", "1"}).exit_code, 0);
  const auto uninterrupted = all_files(path("out/model"));
  fs::remove_all(path("out"));

  std::string command;
  for (const std::string& word : arguments({"--threads", "1"})) {
    command += fmt::format(" '{}'", word);
  }
  const std::string first = path("out/work/features-000001");
  const ProgramResult interrupted = run_program(
      {"sh",
       "-c",
       fmt::format("'{}' {} & pid=$!; until [ -e '{}' ]; do :; done; kill -TERM $pid; wait $pid",
                   program_path(),
                   command,
                   first)},
      kTimeLimit);
  ASSERT_EQ(interrupted.exit_code, 130) << interrupted.err;
  EXPECT_THAT(interrupted.err, HasSubstr("stopped"));
  ASSERT_TRUE(fs::exists(first));

  EXPECT_FALSE(fs::exists(path("out/model"))) << "no half-written model";

  const ProgramResult resumed = run({"--threads", "1"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(all_files(path("out/model")), uninterrupted);
}

TEST_F(Reconstruct, KeepsWhatCanBeReadAmongBrokenFiles) {
  take_demo_frames(6);
  const std::string whole = contents(demo() / "images/frame_0001.jpg");
  write(path("photos/truncated.jpg"), whole.substr(0, whole.size() / 2));
  write(path("photos/text.jpg"), "this is no picture");
  write(path("photos/copy.jpg"), contents(demo() / "images/frame_0000.jpg"));
  const ProgramResult result = run();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto found = reasons();
  EXPECT_EQ(found.at("truncated.jpg"), "unreadable");
  EXPECT_EQ(found.at("text.jpg"), "unreadable");
  EXPECT_EQ(found.at("frame_0000.jpg"), "duplicate") << "copy.jpg comes before it";
  EXPECT_EQ(registered(), found.size() - 3);
}

TEST_F(Reconstruct, SaysWhatIsWrongWithTheInput) {
  EXPECT_EQ(run_trigmesh({"reconstruct", path("nowhere"), "--output", path("out")}).exit_code, 3);
  const ProgramResult empty = run_plain();
  EXPECT_EQ(empty.exit_code, 3);
  EXPECT_THAT(empty.err, HasSubstr("photos"));
  write(path("photos/broken.jpg"), "no picture");
  const ProgramResult unreadable = run_plain();
  EXPECT_EQ(unreadable.exit_code, 4);
  EXPECT_THAT(unreadable.err, HasSubstr("broken.jpg"));
}

TEST_F(Reconstruct, HasAReasonForOneImageAndForStrangers) {
  write(path("photos/a.png"), noise_png(320, 240, 1));
  EXPECT_EQ(run_plain().exit_code, 4);
  EXPECT_EQ(reasons().at("a.png"), "no_overlap");
  write(path("photos/b.png"), noise_png(320, 240, 2));
  write(path("photos/c.png"), noise_png(200, 400, 3));
  write(path("photos/small.png"), noise_png(8, 8, 4));
  EXPECT_EQ(run_plain().exit_code, 4);
  const auto found = reasons();
  EXPECT_EQ(found.at("b.png"), "no_overlap");
  EXPECT_EQ(found.at("c.png"), "no_overlap");
  EXPECT_EQ(found.at("small.png"), "too_small");
}

TEST_F(Reconstruct, RefusesAFlatPictureForLackOfTexture) {
  const auto grey = encode_png(cv::Mat(240, 320, CV_8UC1, cv::Scalar(127)));
  write(path("photos/a.png"), std::string(grey->begin(), grey->end()));
  write(path("photos/b.png"), noise_png(320, 240, 2));
  EXPECT_EQ(run_plain().exit_code, 4);
  EXPECT_EQ(reasons().at("a.png"), "too_few_features");
}

TEST_F(Reconstruct, RefusesACameraThatCannotHaveTakenThePhotographs) {
  write(path("photos/a.png"), noise_png(300, 240, 1));
  const ProgramResult wrong = run();
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("300x240"));
  write(path("hostile.toml"), "format = 1\nmodel = \"pinhole\"\nwidth_px = -5\n");
  EXPECT_EQ(run_plain({"--camera", path("hostile.toml")}).exit_code, 3);
  EXPECT_EQ(run_plain({"--camera", path("missing.toml")}).exit_code, 3);
}

TEST_F(Reconstruct, SaysThatTheOutputCannotBeWritten) {
  write(path("photos/a.png"), noise_png(320, 240, 1));
  write(path("file"), "in the way");
  const ProgramResult result =
      run_trigmesh({"reconstruct", path("photos"), "--output", path("file/out")});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("file/out"));
}

TEST_F(Reconstruct, SaysThatTheDiskIsFullAndLeavesTheOldModel) {
  fs::create_directories(path("out"));
  if (::mount("tmpfs", path("out").c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "a small file system cannot be mounted here (needs root)";
  }
  fs::create_directories(path("out/model"));
  write(path("out/model/old"), "the model before");
  take_demo_frames(6);
  const ProgramResult result = run();
  const std::string kept = contents(path("out/model/old"));
  EXPECT_EQ(::umount(path("out").c_str()), 0);
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_EQ(kept, "the model before");
}

TEST_F(Reconstruct, KeepsTheMemoryLimitOrSaysWhatItNeeds) {
  take_demo_frames(6);
  const ProgramResult too_small = run({"--memory-limit", "20M"});
  EXPECT_EQ(too_small.exit_code, 7);
  EXPECT_THAT(too_small.err, HasSubstr("--memory-limit"));
  const ProgramResult small = run({"--memory-limit", "150M"});
  EXPECT_EQ(small.exit_code, 0) << small.err;
  EXPECT_THAT(small.out, HasSubstr("to keep the memory limit"));
}

TEST_F(Reconstruct, UsesTheKeyframesOfAVideoAndSaysWhatBecameOfEachFrame) {
  const std::vector<std::string> video{"reconstruct",
                                       demo().string(),
                                       "--output",
                                       path("out"),
                                       "--stop-after",
                                       "sparse",
                                       "--frames",
                                       "keyframes",
                                       "--camera",
                                       (demo() / "gt/cameras.txt").string()};
  const ProgramResult result = run_trigmesh(video, kTimeLimit);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto report = nlohmann::json::parse(contents(path("out/model/report.json")));
  const auto& frames = report["frames"];
  const auto pictures = std::distance(fs::directory_iterator(demo() / "images"), {});
  EXPECT_EQ(frames.size(), static_cast<std::size_t>(pictures));
  std::vector<std::string> kept;
  for (const auto& frame : frames) {
    if (frame["verdict"] == "kept") {
      kept.push_back(frame["name"]);
    }
  }
  std::vector<std::string> used;
  for (const auto& image : report["images"]) {
    used.push_back(image["name"]);
  }
  EXPECT_EQ(used, kept);
  EXPECT_LT(used.size(), frames.size());
  EXPECT_EQ(report["totals"]["images_registered"], used.size());
  EXPECT_THAT(contents(path("out/timings.json")), HasSubstr("\"frames\""));
}

TEST_F(Reconstruct, HasNoKeyframesOfPhotographsWithoutTimes) {
  take_demo_frames(20);
  const ProgramResult result = run({"--frames", "keyframes"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("timestamps.csv"));
}

TEST_F(Reconstruct, ExplainsItself) {
  const ProgramResult help = run_trigmesh({"reconstruct", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("Examples:"));
  EXPECT_EQ(run_plain({"--features", "magic"}).exit_code, 2);
  EXPECT_EQ(run_plain({"--no-such-option"}).exit_code, 2);
}

class ReconstructFeatures : public Reconstruct,
                            public ::testing::WithParamInterface<const char*> {};

TEST_P(ReconstructFeatures, RegisterTheDemo) {
  take_demo_frames(4);
  const ProgramResult result = run({"--features", GetParam(), "--match", "sequential", "--quiet"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GE(registered(), 14U);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ReconstructFeatures, ::testing::Values("surf", "akaze", "orb"));

}  // namespace
}  // namespace trigmesh::test_support
