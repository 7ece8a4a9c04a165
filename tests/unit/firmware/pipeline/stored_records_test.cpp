// Image features and pairs as checkpoints hold them: round trips, and nothing else is accepted.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "firmware/pipeline/image_features.hpp"
#include "firmware/pipeline/matching_stage.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace trigmesh {
namespace {

ImageFeatures some_features() {
  ImageFeatures image;
  image.width_px = 640;
  image.height_px = 480;
  image.content = 77;
  image.camera_key = "maker model 35";
  image.exif_focal_px = 512.5;
  image.features.kind = FeatureKind::kOrb;
  image.features.descriptor_bytes = 2;
  image.features.keypoints = {{1.0F, 2.0F, 3.0F, 0.5F, 9.0F}, {4.0F, 5.0F, 6.0F, 0.25F, 8.0F}};
  image.features.descriptors = {1, 2, 3, 4};
  image.colors = {{10, 20, 30}, {40, 50, 60}};
  return image;
}

std::vector<PairRecord> some_pairs() {
  PairRecord record;
  record.pair = {ViewId{3}, ViewId{9}};
  record.geometry.kind = TwoViewKind::kPlanar;
  record.geometry.fundamental << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  record.geometry.candidates = 5;
  record.geometry.homography_inliers = 2;
  record.geometry.inliers = {{FeatureIndex{1}, FeatureIndex{2}},
                             {FeatureIndex{3}, FeatureIndex{4}}};
  return {record, record};
}

TEST(StoredFeatures, ComeBackAsTheyWere) {
  const ImageFeatures before = some_features();
  const auto after = decode_image_features(encode_image_features(before));
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_EQ(encode_image_features(*after), encode_image_features(before));
  EXPECT_EQ(after->camera_key, before.camera_key);
  EXPECT_EQ(after->features.kind, before.features.kind);
  EXPECT_EQ(after->colors, before.colors);
}

TEST(DropMaskedFeatures, KeepsWhatBelongsTogetherOfTheRest) {
  ImageFeatures image = some_features();
  cv::Mat mask(480, 640, CV_8UC1, cv::Scalar(255));
  drop_masked_features(mask, image);
  EXPECT_EQ(encode_image_features(image), encode_image_features(some_features()));
  mask.at<std::uint8_t>(2, 1) = 0;  // the first keypoint
  drop_masked_features(mask, image);
  ASSERT_EQ(image.features.size(), 1U);
  EXPECT_EQ(image.features.keypoints[0].x_px, 4.0F);
  EXPECT_THAT(image.features.descriptors, testing::ElementsAre(3, 4));
  EXPECT_EQ(image.colors, (std::vector<Rgb>{{40, 50, 60}}));
}

TEST(LoadMask, WhiteIsLeftOutAndTheSizeMustFit) {
  cv::Mat picture(2, 3, CV_8UC1, cv::Scalar(0));
  picture.at<std::uint8_t>(1, 2) = 255;
  const std::vector<std::uint8_t> png = *encode_png(picture);
  PhotoSet photos;
  photos.names = {"a.jpg"};
  EXPECT_TRUE(load_mask(photos, 0, 3, 2)->empty());
  photos.read_mask = [&](std::size_t) -> Result<std::optional<std::vector<std::uint8_t>>> {
    return std::optional(png);
  };
  const auto mask = load_mask(photos, 0, 3, 2);
  ASSERT_TRUE(mask) << mask.error().message;
  EXPECT_EQ(mask->at<std::uint8_t>(0, 0), 255);
  EXPECT_EQ(mask->at<std::uint8_t>(1, 2), 0);
  const auto other_size = load_mask(photos, 0, 4, 2);
  ASSERT_FALSE(other_size);
  EXPECT_EQ(other_size.error().code, ErrorCode::kCorruptData);
}

TEST(StoredFeatures, AreRefusedWhenCutOrFollowedByMore) {
  std::vector<std::uint8_t> bytes = encode_image_features(some_features());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto cut = decode_image_features(std::span(bytes).first(length));
    ASSERT_FALSE(cut) << "cut to " << length;
    EXPECT_EQ(cut.error().code, ErrorCode::kCorruptData);
  }
  bytes.push_back(0);
  EXPECT_FALSE(decode_image_features(bytes));
}

TEST(StoredFeatures, AreRefusedWhenCountsContradict) {
  ImageFeatures image = some_features();
  image.colors.pop_back();
  EXPECT_FALSE(decode_image_features(encode_image_features(image)));
}

TEST(StoredPairs, ComeBackAsTheyWere) {
  const std::vector<PairRecord> before = some_pairs();
  const auto after = decode_pairs(encode_pairs(before));
  ASSERT_TRUE(after) << after.error().message;
  ASSERT_EQ(after->size(), before.size());
  EXPECT_EQ(after->front().pair, before.front().pair);
  EXPECT_EQ(after->front().geometry.fundamental, before.front().geometry.fundamental);
  EXPECT_EQ(after->front().geometry.inliers, before.front().geometry.inliers);
  EXPECT_EQ(encode_pairs(*after), encode_pairs(before));
}

TEST(StoredPairs, AreRefusedWhenCut) {
  const std::vector<std::uint8_t> bytes = encode_pairs(some_pairs());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(decode_pairs(std::span(bytes).first(length))) << "cut to " << length;
  }
}

/// A detector that finds two keypoints at places of our choice.
class FixedKeypointsMock final : public FeatureExtractor {
 public:
  [[nodiscard]] Result<FeatureSet> extract(const cv::Mat& /*grey*/) const override {
    FeatureSet set;
    set.descriptor_bytes = 1;
    set.keypoints = {{8.0F, 8.0F, 1.0F, 0.0F, 1.0F}, {24.0F, 8.0F, 1.0F, 0.0F, 1.0F}};
    set.descriptors = {1, 2};
    return set;
  }
};

TEST(ExtractImageFeatures, ColoursKeypointsByWhatIsAroundThem) {
  cv::Mat rgb(32, 32, CV_8UC3, cv::Scalar(200, 100, 50));
  rgb.colRange(16, 32).setTo(cv::Scalar(10, 20, 30));
  const auto file = encode_png(rgb);
  ASSERT_TRUE(file);
  const auto image = extract_image_features(*file, FixedKeypointsMock());
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->width_px, 32);
  EXPECT_THAT(image->colors, ::testing::ElementsAre(Rgb{200, 100, 50}, Rgb{10, 20, 30}));
}

TEST(ExtractImageFeatures, RefusesBytesThatAreNoPicture) {
  const std::vector<std::uint8_t> bytes{'n', 'o'};
  const auto image = extract_image_features(bytes, FixedKeypointsMock());
  ASSERT_FALSE(image);
  EXPECT_EQ(image.error().code, ErrorCode::kCorruptData);
}

}  // namespace
}  // namespace trigmesh
