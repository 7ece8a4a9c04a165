// Video files: made from the demo recording by ffmpeg, read by the program as a user gives them.

#include <algorithm>
#include <chrono>
#include <fstream>
#include <map>
#include <stop_token>
#include <string>
#include <vector>

#include <sys/mount.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "firmware/photos/video_input.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "tests/integration/run_program.hpp"

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::Le;

constexpr std::chrono::seconds kTimeLimit{100};
constexpr int kDemoFrames = 64;

class QuietListener : public ProgressListener {
 public:
  void on_progress(const Progress&) override {}
};

class Video : public ScratchTest {
 protected:
  void SetUp() override {
    ScratchTest::SetUp();
    if (!find_program("ffmpeg")) {
      GTEST_SKIP() << "ffmpeg is not installed: apt-get install ffmpeg";
    }
  }

  [[nodiscard]] static fs::path demo() { return source_path("tools/demo/courtyard"); }

  void ffmpeg(const std::vector<std::string>& arguments) const {
    std::vector<std::string> command{"ffmpeg", "-nostdin", "-loglevel", "error", "-y"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const ProgramResult result = run_program(command, kTimeLimit);
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }

  /// A video of the demo at 30 frames a second, `filter`ed. Its index comes first, so that a part
  /// of it can be read.
  [[nodiscard]] std::string demo_video(const std::string& name,
                                       const std::string& filter = "null") const {
    ffmpeg({"-framerate",
            "30",
            "-i",
            (demo() / "images/frame_%04d.jpg").string(),
            "-vf",
            filter,
            "-fps_mode",
            "vfr",
            "-c:v",
            "libx264",
            "-preset",
            "veryfast",
            "-crf",
            "12",
            "-pix_fmt",
            "yuv420p",
            "-movflags",
            "+faststart",
            path(name)});
    return path(name);
  }

  [[nodiscard]] ProgramResult reconstruct(const std::string& input) const {
    return run_trigmesh({"reconstruct",
                         input,
                         "--output",
                         path("out"),
                         "--stop-after",
                         "sparse",
                         "--no-upsample",
                         "--camera",
                         (demo() / "gt/cameras.txt").string()},
                        kTimeLimit);
  }

  [[nodiscard]] Result<PhotoSet> open(const std::string& input,
                                      const std::stop_token& stop = {}) const {
    QuietListener listener;
    return open_video(input, path("out"), MaskUse::kUse, 2, listener, stop);
  }

  [[nodiscard]] nlohmann::json report() const {
    return nlohmann::json::parse(contents(path("out/model/report.json")));
  }
};

/// The mean difference between two pictures, grey levels.
double difference(const fs::path& a, const fs::path& b) {
  const auto grey = [](const fs::path& file) {
    const std::string text = contents(file);
    const std::vector<std::uint8_t> bytes(text.begin(), text.end());
    return decode_image(bytes, {.channels = ImageChannels::kGrey})->grey;
  };
  const cv::Mat first = grey(a);
  return cv::norm(first, grey(b), cv::NORM_L1) / static_cast<double>(first.total());
}

TEST_F(Video, BecomesAModelOfItsKeyframes) {
  const ProgramResult result = reconstruct(demo_video("the \"walk\" it's 100%d.mp4"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto told = report();
  EXPECT_THAT(std::string(told["input"]),
              HasSubstr("the \"walk\" it's 100%d.mp4: video, 64 frames"));
  EXPECT_EQ(told["frames"].size(), kDemoFrames);
  const auto kept = static_cast<int>(told["images"].size());
  EXPECT_THAT(kept, AllOf(Ge(8), Le(kDemoFrames))) << "keyframes of the walk";
  EXPECT_EQ(told["totals"]["images_registered"], kept);
}

TEST_F(Video, GivesEveryFrameInItsOrderAndTime) {
  const auto photos = open(demo_video("walk.mp4"));
  ASSERT_TRUE(photos.has_value()) << photos.error().message;
  ASSERT_EQ(photos->names.size(), kDemoFrames);
  EXPECT_TRUE(photos->warnings.empty());
  for (const int i : {0, 20, 63}) {
    const auto frame = [i](int other) {
      return demo() / fmt::format("images/frame_{:04}.jpg", std::clamp(i + other, 0, 63));
    };
    const fs::path taken = path(fmt::format("out/frames/images/{:06}.jpg", i + 1));
    EXPECT_LT(difference(taken, frame(0)), 3.0) << i;
    EXPECT_GT(difference(taken, frame(i == 0 ? 1 : -1)), 6.0) << i;
    const std::chrono::duration<double> time = photos->timestamps[static_cast<std::size_t>(i)];
    EXPECT_NEAR(time.count(), i / 30.0, 1e-6) << i;
  }
}

TEST_F(Video, KeepsUnevenTimes) {
  const auto photos = open(demo_video("uneven.mkv", "select='eq(n,2)+eq(n,3)+eq(n,9)+eq(n,30)'"));
  ASSERT_TRUE(photos.has_value()) << photos.error().message;
  std::vector<double> times_s;
  for (const auto time : photos->timestamps) {
    times_s.push_back(std::chrono::duration<double>(time).count());
  }
  // Matroska counts milliseconds.
  const auto near = [](double frames) { return ::testing::DoubleNear(frames / 30.0, 0.0011); };
  EXPECT_THAT(times_s, ElementsAre(near(0), near(1), near(7), near(28)));
}

TEST_F(Video, TurnsFramesUpright) {
  const std::string lying = demo_video("lying.mp4", "select='lt(n,3)'");
  ffmpeg({"-i", lying, "-c", "copy", "-metadata:s:v:0", "rotate=90", path("turned.mp4")});
  ASSERT_TRUE(open(path("turned.mp4")).has_value());
  const std::string frame = contents(path("out/frames/images/000001.jpg"));
  const auto info = probe_image(std::vector<std::uint8_t>(frame.begin(), frame.end()));
  ASSERT_TRUE(info.has_value());
  EXPECT_LT(info->width_px, info->height_px);
}

TEST_F(Video, IsReadOnceAndAgainWhenItChanged) {
  const std::string video = demo_video("walk.mp4", "select='lt(n,5)'");
  ASSERT_TRUE(open(video).has_value());
  const fs::path first = path("out/frames/images/000001.jpg");
  const auto written = fs::last_write_time(first);
  fs::last_write_time(video, fs::file_time_type::clock::now());
  ASSERT_TRUE(open(video).has_value());
  EXPECT_EQ(fs::last_write_time(first), written) << "the same bytes are not read again";
  const auto shorter = open(demo_video("walk.mp4", "select='lt(n,4)'"));
  ASSERT_TRUE(shorter.has_value());
  EXPECT_EQ(shorter->names.size(), 4U);
}

TEST_F(Video, IsReadAnewAfterAnInterruption) {
  class Stopper : public ProgressListener {
   public:
    void on_progress(const Progress& progress) override {
      if (progress.done > 0) {
        stop.request_stop();
      }
    }

    std::stop_source stop;
  };

  const std::string video = demo_video("walk.mp4");
  Stopper stopper;
  const auto stopped =
      open_video(video, path("out"), MaskUse::kUse, 2, stopper, stopper.stop.get_token());
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  EXPECT_TRUE(fs::is_empty(path("out"))) << "nothing half done is left";
  fs::create_directories(path("out/.frames.part/images"));
  std::ofstream(path("out/.frames.part/images/000099.jpg")) << "of a run that was killed";
  const auto photos = open(video);
  ASSERT_TRUE(photos.has_value()) << photos.error().message;
  EXPECT_EQ(photos->names.size(), kDemoFrames);
}

TEST_F(Video, IsUsedAsFarAsItGoesWhenCutOff) {
  const std::string whole = contents(demo_video("walk.mp4"));
  std::ofstream(path("cut.mp4"), std::ios::binary) << whole.substr(0, whole.size() / 2);
  const ProgramResult result = reconstruct(path("cut.mp4"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the video is damaged or was cut off"));
  EXPECT_THAT(result.out, HasSubstr("of about 64 frames could be decoded"));
  EXPECT_THAT(report()["notes"].dump(), HasSubstr("cut off")) << "also in the report";
}

TEST_F(Video, IsRefusedWithTheReasonWhenItIsNone) {
  ffmpeg({"-f", "lavfi", "-i", "sine=d=1", path("song.m4a")});
  std::ofstream(path("noise.mp4"), std::ios::binary) << std::string(5000, '\x01');
  const std::map<std::string, std::string> words{
      {"song.m4a", "has no moving pictures"},
      {"noise.mp4", "neither a list of photographs nor a video"}};
  for (const auto& [name, reason] : words) {
    const ProgramResult result = reconstruct(path(name));
    EXPECT_EQ(result.exit_code, 3) << name;
    EXPECT_THAT(result.err, HasSubstr(reason)) << name;
    EXPECT_FALSE(fs::exists(path("out"))) << name;
  }
}

TEST_F(Video, DoesNotReplaceAFolderOfTheUser) {
  fs::create_directories(path("out/frames"));
  std::ofstream(path("out/frames/mine.txt")) << "mine";
  const ProgramResult result = reconstruct(demo_video("walk.mp4", "select='lt(n,4)'"));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("was not made from a video"));
  EXPECT_EQ(contents(path("out/frames/mine.txt")), "mine");
}

TEST_F(Video, SaysBeforehandThatTheDiskIsTooSmall) {
  fs::create_directories(path("out"));
  if (::mount("tmpfs", path("out").c_str(), "tmpfs", 0, "size=128k") != 0) {
    GTEST_SKIP() << "a small file system cannot be mounted here (needs root)";
  }
  const ProgramResult result = reconstruct(demo_video("walk.mp4", "select='lt(n,20)'"));
  const bool is_empty = fs::is_empty(path("out"));
  EXPECT_EQ(::umount(path("out").c_str()), 0);
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_THAT(result.err, HasSubstr("MB or more"));
  EXPECT_TRUE(is_empty);
}

TEST_F(Video, OpensNothingButItself) {
  const std::string video = demo_video("walk.mp4", "select='lt(n,4)'");
  // A playlist that names the video, with a byte that makes it look binary.
  std::ofstream(path("list.mp4"), std::ios::binary)
      << "ffconcat version 1.0\nfile '" << video << "'\n# \x01\n";
  const ProgramResult result = reconstruct(path("list.mp4"));
  EXPECT_EQ(result.exit_code, 3) << result.out;
}

TEST_F(Video, SaysHowToGetTheProgramThatItNeeds) {
  const std::string video = demo_video("walk.mp4", "select='lt(n,4)'");
  const ProgramResult result = run_program({"/usr/bin/env",
                                            "PATH=" + path("nothing"),
                                            program_path(),
                                            "reconstruct",
                                            video,
                                            "--output",
                                            path("out")},
                                           kTimeLimit);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("apt-get install ffmpeg"));
}

}  // namespace
}  // namespace trigmesh::test_support
