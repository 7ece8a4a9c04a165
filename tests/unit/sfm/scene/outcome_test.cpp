#include "sfm/scene/outcome.hpp"

#include <array>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

constexpr std::array kAllReasons{RefusalReason::kNone,
                                 RefusalReason::kUnreadable,
                                 RefusalReason::kTooSmall,
                                 RefusalReason::kTooFewFeatures,
                                 RefusalReason::kDuplicate,
                                 RefusalReason::kNoOverlap,
                                 RefusalReason::kPureRotation,
                                 RefusalReason::kNoParallax,
                                 RefusalReason::kTooFewMapMatches,
                                 RefusalReason::kPoseRejected,
                                 RefusalReason::kPoseUnstable,
                                 RefusalReason::kOtherComponent,
                                 RefusalReason::kNoGivenPose};

TEST(RefusalReason, HasAStableDistinctName) {
  std::set<std::string_view> names;
  for (const RefusalReason reason : kAllReasons) {
    names.insert(to_string(reason));
  }
  EXPECT_EQ(names.size(), kAllReasons.size());
  EXPECT_EQ(to_string(RefusalReason::kNone), "registered");
  EXPECT_EQ(to_string(RefusalReason::kTooFewMapMatches), "too_few_map_matches");
}

TEST(RefusalReason, GivesTheOperatorOneDistinctAdvice) {
  std::set<std::string_view> sentences;
  for (const RefusalReason reason : kAllReasons) {
    const std::string_view text = advice(reason);
    sentences.insert(text);
    if (reason == RefusalReason::kNone) {
      EXPECT_TRUE(text.empty());
      continue;
    }
    EXPECT_GE(text.size(), 40U) << to_string(reason);
    EXPECT_EQ(text.back(), '.') << to_string(reason);
  }
  EXPECT_EQ(sentences.size(), kAllReasons.size());
}

}  // namespace
}  // namespace trigmesh
