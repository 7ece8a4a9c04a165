#include <algorithm>
#include <bit>
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/core/utility.hpp>

#include "sfm/features/features.hpp"
#include "tests/unit/sfm/features/synthetic_texture.hpp"

namespace trigmesh {
namespace {

using testing::random_texture;
using testing::render;
using testing::Similarity;

class OpenCvFeatures : public ::testing::TestWithParam<FeatureKind> {
 protected:
  static FeatureSet extract(const cv::Mat& grey, const FeatureOptions& options) {
    auto extractor = create_feature_extractor(GetParam(), options);
    EXPECT_TRUE(extractor.has_value());
    auto set = (*extractor)->extract(grey);
    EXPECT_TRUE(set.has_value());
    return set ? *set : FeatureSet{};
  }

  static cv::Mat view(double shift_x, double shift_y) {
    return render(random_texture(900, 420.0, 31),
                  {.shift_x = 180.0 + shift_x, .shift_y = 160.0 + shift_y},
                  360,
                  320);
  }
};

int hamming(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) {
  int bits = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    bits += std::popcount(static_cast<unsigned>(a[i] ^ b[i]));
  }
  return bits;
}

TEST_P(OpenCvFeatures, MatchesFollowAKnownShift) {
  const FeatureSet a = extract(view(0.0, 0.0), {.max_keypoints = 300, .oriented = false});
  const FeatureSet b = extract(view(7.0, -5.0), {.max_keypoints = 300, .oriented = false});
  ASSERT_GT(a.size(), 60U);
  int right = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t best = 0;
    for (std::size_t j = 1; j < b.size(); ++j) {
      best =
          hamming(a.descriptor(i), b.descriptor(j)) < hamming(a.descriptor(i), b.descriptor(best))
              ? j
              : best;
    }
    const double dx = static_cast<double>(b.keypoints[best].x_px - a.keypoints[i].x_px) - 7.0;
    const double dy = static_cast<double>(b.keypoints[best].y_px - a.keypoints[i].y_px) + 5.0;
    right += std::hypot(dx, dy) < 1.5 ? 1 : 0;
  }
  EXPECT_GT(right, static_cast<int>(a.size()) * 6 / 10);
}

TEST_P(OpenCvFeatures, DescriptorsAreWholeWordsAndKeypointsCoarseToFine) {
  const FeatureSet set = extract(view(0.0, 0.0), {.max_keypoints = 100});
  EXPECT_EQ(set.kind, GetParam());
  EXPECT_EQ(set.descriptor_bytes, GetParam() == FeatureKind::kAkaze ? 64U : 32U);
  EXPECT_LE(set.size(), 100U);
  EXPECT_GT(set.size(), 50U);
  EXPECT_EQ(set.descriptors.size(), set.size() * set.descriptor_bytes);
  EXPECT_TRUE(std::is_sorted(
      set.keypoints.begin(), set.keypoints.end(), [](const Keypoint& a, const Keypoint& b) {
        return a.scale_px > b.scale_px;
      }));
}

TEST_P(OpenCvFeatures, SameBytesWhateverOpenCvsThreadCount) {
  const cv::Mat image = view(0.0, 0.0);
  const int before = cv::getNumThreads();
  cv::setNumThreads(1);
  const FeatureSet one = extract(image, {});
  cv::setNumThreads(4);
  const FeatureSet four = extract(image, {});
  cv::setNumThreads(before);
  EXPECT_EQ(one.descriptors, four.descriptors);
  ASSERT_EQ(one.size(), four.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one.keypoints[i].x_px, four.keypoints[i].x_px);
    EXPECT_EQ(one.keypoints[i].y_px, four.keypoints[i].y_px);
  }
}

TEST_P(OpenCvFeatures, UprightKeypointsHaveNoAngleAndOrientedOnesDo) {
  const auto has_angle = [](const Keypoint& k) { return k.angle_rad != 0.0F; };
  const FeatureSet upright = extract(view(0.0, 0.0), {.oriented = false});
  EXPECT_TRUE(std::none_of(upright.keypoints.begin(), upright.keypoints.end(), has_angle));
  const FeatureSet oriented = extract(view(0.0, 0.0), {.oriented = true});
  EXPECT_GT(std::count_if(oriented.keypoints.begin(), oriented.keypoints.end(), has_angle), 50);
}

TEST_P(OpenCvFeatures, BlobIsFoundAtItsPixelAndScale) {
  if (GetParam() == FeatureKind::kOrb) {
    GTEST_SKIP() << "ORB finds corners, not blobs";
  }
  const cv::Mat image =
      render({{.x = 100.0, .y = 80.0, .sigma = 4.0, .amplitude = 100.0}}, {}, 200, 160);
  const FeatureSet set = extract(image, {});
  ASSERT_GE(set.size(), 1U);
  const auto best = std::max_element(
      set.keypoints.begin(), set.keypoints.end(), [](const Keypoint& a, const Keypoint& b) {
        return a.response < b.response;
      });
  EXPECT_NEAR(best->x_px, 100.0F, 0.5F);
  EXPECT_NEAR(best->y_px, 80.0F, 0.5F);
  EXPECT_NEAR(best->scale_px, 4.0F, 1.6F);
}

TEST_P(OpenCvFeatures, FlatAndTinyImagesGiveEmptySets) {
  EXPECT_EQ(extract(cv::Mat(120, 160, CV_8UC1, cv::Scalar(99)), {}).size(), 0U);
  EXPECT_EQ(extract(cv::Mat(16, 16, CV_8UC1, cv::Scalar(99)), {}).size(), 0U);
}

INSTANTIATE_TEST_SUITE_P(BinaryKinds,
                         OpenCvFeatures,
                         ::testing::Values(FeatureKind::kAkaze, FeatureKind::kOrb),
                         [](const auto& param_info) {
                           return std::string(to_string(param_info.param));
                         });

}  // namespace
}  // namespace trigmesh
