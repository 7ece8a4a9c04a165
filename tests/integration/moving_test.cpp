// An object that stands elsewhere in every photograph: its masks, and what they are good for.

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "sfm/exchange/image_codec.hpp"
#include "tests/integration/run_program.hpp"

namespace trigmesh::test_support {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kTimeLimit{300};

class Moving : public ScratchTest {
 protected:
  [[nodiscard]] static fs::path data() { return source_path("tests/data/moving"); }

  [[nodiscard]] ProgramResult run(std::vector<std::string> words,
                                  const std::vector<std::string>& more) const {
    words.insert(words.end(), {"--depth-size", "240", "--quiet"});
    words.insert(words.end(), more.begin(), more.end());
    return run_trigmesh(words, kTimeLimit);
  }

  [[nodiscard]] ProgramResult reconstruct(const std::string& last_stage,
                                          const std::vector<std::string>& more) const {
    return run(
        {"reconstruct", data().string(), "--output", path("out"), "--stop-after", last_stage},
        more);
  }

  [[nodiscard]] ProgramResult densify(const std::vector<std::string>& more) const {
    return run({"densify", path("out"), "--images", data().string()}, more);
  }

  /// A mask, larger than 0 where it is white, at the size of the truth.
  [[nodiscard]] static cv::Mat mask(const fs::path& file) {
    const std::string bytes = contents(file.string());
    const std::vector<std::uint8_t> png(bytes.begin(), bytes.end());
    const auto decoded = decode_image(png, {.channels = ImageChannels::kGrey});
    if (!decoded) {
      ADD_FAILURE() << file << ": " << decoded.error().message;
      return cv::Mat(240, 320, CV_8UC1, cv::Scalar(0));
    }
    cv::Mat small;
    cv::resize(decoded->grey, small, cv::Size(320, 240), 0.0, 0.0, cv::INTER_NEAREST);
    return small;
  }
};

TEST_F(Moving, ObjectIsMaskedAndNothingElse) {
  ASSERT_EQ(reconstruct("dense", {"--threads", "2"}).exit_code, 0);
  const auto report = nlohmann::json::parse(contents(path("out/model/report.json")));
  std::size_t masks = 0;
  for (const auto& entry : fs::directory_iterator(path("out/model/masks"))) {
    const cv::Mat found = mask(entry.path());
    const cv::Mat truth = mask(source_path("tests/data/moving_truth") / entry.path().filename());
    const auto both = static_cast<double>(cv::countNonZero(found & truth));
    EXPECT_GT(both / cv::countNonZero(truth), 0.95) << entry.path();
    EXPECT_GT(both / cv::countNonZero(found), 0.9) << entry.path();
    ++masks;
  }
  // The others show a side of it that no other photograph shows.
  EXPECT_GE(masks, 5U);
  EXPECT_EQ(report["moving"]["images"].size(), masks);
  EXPECT_GT(report["moving"]["masked_ratio"], 0.04);
  EXPECT_LT(report["moving"]["masked_ratio"], 0.12);

  const auto model = all_files(path("out/model"));
  ASSERT_EQ(densify({"--moving", "off"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(path("out/model/masks"))) << "masks that are not in force are gone";
  EXPECT_NE(contents(path("out/model/dense.ply")), model.at("dense.ply"));
  EXPECT_FALSE(nlohmann::json::parse(contents(path("out/model/report.json"))).contains("moving"));

  for (const auto& entry : fs::directory_iterator(path("out/work"))) {
    if (entry.path().filename().string().starts_with("m")) {
      fs::remove(entry.path());  // masks and masked maps, to be made again
    }
  }
  ASSERT_EQ(densify({"--threads", "1"}).exit_code, 0);
  const auto again = all_files(path("out/model"));
  EXPECT_EQ(again.at("masks/A_001.png"), model.at("masks/A_001.png"));
  EXPECT_TRUE(again.at("dense.ply") == model.at("dense.ply")) << "threads change no byte";
}

TEST_F(Moving, MatchesOnTheObjectMakeNoPoints) {
  ASSERT_EQ(reconstruct("sparse", {}).exit_code, 0);
  const std::string without = contents(path("out/model/sparse.ply"));
  ASSERT_EQ(reconstruct("sparse", {"--moving", "off"}).exit_code, 0);
  EXPECT_LT(without.size(), contents(path("out/model/sparse.ply")).size());
}

}  // namespace
}  // namespace trigmesh::test_support
