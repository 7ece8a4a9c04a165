#include "firmware/daemon/live_mapper.hpp"

#include <filesystem>
#include <fstream>
#include <future>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/photos/photo_input.hpp"
#include "firmware/photos/session_options.hpp"
#include "tests/support/demo_session.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using test_support::demo_camera_profile;
using test_support::demo_pictures;
using test_support::TemporaryFolder;
using ::testing::Each;
using ::testing::Field;
using ::testing::Ge;
using ::testing::SizeIs;

constexpr const char* kSession = "20260101-000000-abcd";
/// Of the walk; one more stands for a frame that was not meant.
constexpr std::size_t kPictures = 9;

class Silence final : public ProgressListener {
 public:
  void on_progress(const Progress& /*progress*/) override {}
};

ReconstructionOptions quick_options() {
  ReconstructionOptions options;
  options.num_threads = 2;
  options.features.upsample = false;
  options.build.last_stage = LastStage::kSparse;
  return options;
}

std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      std::ifstream stream(entry.path(), std::ios::binary);
      files[entry.path().lexically_relative(folder).string()] = {
          std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    }
  }
  return files;
}

/// A walk of the demo recording, as files, and what is made of it.
class LiveMapping : public ::testing::Test {
 protected:
  LiveMapping() {
    const auto pictures = demo_pictures(2);
    for (std::size_t i = 0; i <= kPictures; ++i) {
      put(files_.path() / "images", i, pictures[i]);
    }
  }

  static void put(const fs::path& folder, std::size_t i, const std::vector<std::uint8_t>& bytes) {
    fs::create_directories(folder);
    std::ofstream stream(folder / fmt::format("{:06}.jpg", i + 1), std::ios::binary);
    stream.write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
  }

  [[nodiscard]] CaptureFrame frame(std::size_t i) const {
    return {static_cast<std::uint32_t>(i + 1),
            files_.path() / "images" / fmt::format("{:06}.jpg", i + 1)};
  }

  std::unique_ptr<LiveMapper> mapper(std::size_t max_waiting = 256) {
    LiveMapperOptions options;
    options.reconstruction = quick_options();
    options.max_waiting = max_waiting;
    return std::make_unique<LiveMapper>(options, clock_, [this](const MapFollowed& map) {
      const std::lock_guard lock(mutex_);
      followed_.push_back(map);
    });
  }

  void begin(LiveMapper& live) {
    live.follow(CaptureBegan{kSession, work(), demo_camera_profile()});
  }

  void end(LiveMapper& live) {
    live.follow(CaptureEnded{});
    live.wait_for_end(kSession, {});
  }

  [[nodiscard]] fs::path work() const { return files_.path() / "work"; }

  /// The model of the first so many pictures, with what lies in this work folder.
  std::map<std::string, std::string> model_of(std::size_t pictures, const fs::path& work) {
    auto photos =
        open_photos((files_.path() / "images").string(), Subfolders::kIgnore, MaskUse::kIgnore);
    EXPECT_TRUE(photos);
    photos->names.resize(pictures);
    photos->is_walk = true;
    ReconstructionOptions options = quick_options();
    options.cameras = *cameras_of_profile(demo_camera_profile(), kSession);
    const TemporaryFolder output;
    ModelFolder folder(output.path());
    Silence silence;
    const auto made = reconstruct(*photos,
                                  {folder, work, {}, ReconstructionPlaces::FinishedWork::kKeep},
                                  options,
                                  clock_,
                                  silence,
                                  {});
    EXPECT_TRUE(made) << made.error().message;
    return files_of(folder.model());
  }

  const SteadyClock clock_;
  TemporaryFolder files_;
  std::mutex mutex_;
  std::vector<MapFollowed> followed_;
};

TEST_F(LiveMapping, ModelIsTheSameAsWithoutItAndItsFirstStagesAreDone) {
  auto live = mapper();
  begin(*live);
  for (std::size_t i = 0; i < kPictures; ++i) {
    live->follow(frame(i));
  }
  end(*live);
  ASSERT_THAT(followed_, SizeIs(kPictures));
  EXPECT_EQ(followed_.back().frame.following, MapFollowing::kTracked);
  EXPECT_EQ(followed_.back().tracked, kPictures);
  const auto pieces = files_of(work());
  EXPECT_THAT(pieces, SizeIs(2 * kPictures)) << "features and pairs of each";
  const TemporaryFolder nothing;
  EXPECT_EQ(model_of(kPictures, work()), model_of(kPictures, nothing.path()));
  EXPECT_EQ(files_of(work()), pieces) << "nothing was found again";
}

TEST_F(LiveMapping, ADiscardedFrameIsAsIfItHadNeverBeen) {
  auto live = mapper();
  begin(*live);
  for (std::size_t i = 0; i < 7; ++i) {
    live->follow(frame(i));
  }
  live->follow(frame(kPictures));
  live->follow(CaptureUndone{});
  for (std::size_t i = 7; i < kPictures; ++i) {
    live->follow(frame(i));
  }
  end(*live);
  EXPECT_EQ(followed_.back().tracked, kPictures);
  const TemporaryFolder nothing;
  EXPECT_EQ(model_of(kPictures, work()), model_of(kPictures, nothing.path()));
}

TEST_F(LiveMapping, WhatWasNotMappedIsMappedAfterwards) {
  auto live = mapper(/*max_waiting=*/2);
  begin(*live);
  for (std::size_t i = 0; i < kPictures; ++i) {
    live->follow(frame(i));  // far quicker than they can be mapped
  }
  end(*live);
  EXPECT_LT(followed_.size(), kPictures) << "it was left alone";
  const TemporaryFolder nothing;
  EXPECT_EQ(model_of(kPictures, work()), model_of(kPictures, nothing.path()));
}

TEST_F(LiveMapping, EndingInTheMiddleKeepsWhatIsFinished) {
  {
    auto live = mapper();
    begin(*live);
    for (std::size_t i = 0; i < kPictures; ++i) {
      live->follow(frame(i));
    }
  }  // the program ends
  const TemporaryFolder nothing;
  EXPECT_EQ(model_of(kPictures, work()), model_of(kPictures, nothing.path()));
}

TEST_F(LiveMapping, AFrameThatIsNoPictureIsToldAndPassedOver) {
  put(files_.path() / "images", 5, {1, 2, 3});
  auto live = mapper();
  begin(*live);
  for (std::size_t i = 0; i < kPictures; ++i) {
    live->follow(frame(i));
  }
  end(*live);
  ASSERT_THAT(followed_, SizeIs(kPictures));
  EXPECT_EQ(followed_.back().tracked, kPictures - 1);
}

TEST_F(LiveMapping, AProfileThatIsNoneLeavesTheMappingForLater) {
  auto live = mapper();
  live->follow(CaptureBegan{kSession, work(), "no profile"});
  live->follow(frame(0));
  end(*live);
  EXPECT_THAT(followed_, SizeIs(0));
}

TEST_F(LiveMapping, WhoWaitsForACaptureThatIsUnknownDoesNotWait) {
  auto live = mapper();
  live->wait_for_end("another", {});
  begin(*live);
  std::stop_source stop;
  stop.request_stop();
  live->wait_for_end(kSession, stop.get_token());  // it has not ended: the request ends the waiting
}

}  // namespace
}  // namespace trigmesh
