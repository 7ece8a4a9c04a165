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

  [[nodiscard]] ProgramResult reconstruct(const std::string& output,
                                          const std::vector<std::string>& more) const {
    std::vector<std::string> all{"reconstruct",
                                 (data() / "images").string(),
                                 "--output",
                                 path(output),
                                 "--stop-after",
                                 "dense",
                                 "--depth-size",
                                 "320",
                                 "--quiet"};
    all.insert(all.end(), more.begin(), more.end());
    return run_trigmesh(all, kTimeLimit);
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
  ASSERT_EQ(reconstruct("out", {"--threads", "2"}).exit_code, 0);
  const auto report = nlohmann::json::parse(contents(path("out/model/report.json")));
  std::size_t masks = 0;
  for (const auto& entry : fs::directory_iterator(path("out/model/masks"))) {
    const cv::Mat found = mask(entry.path());
    const cv::Mat truth = mask(data() / "truth" / entry.path().filename());
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
  ASSERT_EQ(reconstruct("again", {"--threads", "1"}).exit_code, 0);
  EXPECT_EQ(all_files(path("again/model")), model) << "the number of threads changes no byte";
}

TEST_F(Moving, MasksComeAndGoWithTheOption) {
  ASSERT_EQ(reconstruct("out", {"--moving", "off"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(path("out/model/masks")));
  EXPECT_FALSE(nlohmann::json::parse(contents(path("out/model/report.json"))).contains("moving"));
  const std::vector<std::string> densify{"densify",
                                         path("out"),
                                         "--images",
                                         (data() / "images").string(),
                                         "--depth-size",
                                         "320",
                                         "--quiet"};
  const std::string without = contents(path("out/model/dense.ply"));
  ASSERT_EQ(run_trigmesh(densify, kTimeLimit).exit_code, 0);
  EXPECT_TRUE(fs::exists(path("out/model/masks/A_001.png")));
  EXPECT_NE(contents(path("out/model/dense.ply")), without);
  std::vector<std::string> off = densify;
  off.insert(off.end(), {"--moving", "off"});
  ASSERT_EQ(run_trigmesh(off, kTimeLimit).exit_code, 0);
  EXPECT_FALSE(fs::exists(path("out/model/masks")));
  EXPECT_EQ(contents(path("out/model/dense.ply")), without);
}

}  // namespace
}  // namespace trigmesh::test_support
