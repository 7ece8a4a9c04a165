#include "sfm/features/features.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

constexpr FeatureKind kKinds[] = {
    FeatureKind::kSift, FeatureKind::kSurf, FeatureKind::kAkaze, FeatureKind::kOrb};

TEST(FeatureKind, NamesComeBackAsTheSameKind) {
  for (const FeatureKind kind : kKinds) {
    EXPECT_EQ(feature_kind_from_string(to_string(kind)), kind);
  }
}

TEST(FeatureKind, UnknownNameIsRefused) {
  EXPECT_EQ(feature_kind_from_string("SIFT"), std::nullopt);
  EXPECT_EQ(feature_kind_from_string(""), std::nullopt);
}

TEST(DescriptorMetric, BytesCompareByDotProductAndBitStringsByHamming) {
  EXPECT_EQ(descriptor_metric(FeatureKind::kSift), DescriptorMetric::kDotProduct);
  EXPECT_EQ(descriptor_metric(FeatureKind::kSurf), DescriptorMetric::kDotProduct);
  EXPECT_EQ(descriptor_metric(FeatureKind::kAkaze), DescriptorMetric::kHamming);
  EXPECT_EQ(descriptor_metric(FeatureKind::kOrb), DescriptorMetric::kHamming);
}

TEST(FeatureOptions, BudgetOutOfRangeIsRefusedAndNamed) {
  for (const int max_keypoints : {-1, 0, 15, 100001}) {
    const auto made =
        create_feature_extractor(FeatureKind::kSift, {.max_keypoints = max_keypoints});
    ASSERT_FALSE(made.has_value());
    EXPECT_EQ(made.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(made.error().message, HasSubstr("max_keypoints"));
  }
}

TEST(FeatureOptions, BudgetAtItsLimitsIsAccepted) {
  EXPECT_TRUE(FeatureOptions{.max_keypoints = 16}.validate());
  EXPECT_TRUE(FeatureOptions{.max_keypoints = 100000}.validate());
}

}  // namespace
}  // namespace trigmesh
