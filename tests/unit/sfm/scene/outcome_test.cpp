#include "sfm/scene/outcome.hpp"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(RefusalReason, HasAStableDistinctName) {
  std::set<std::string_view> names;
  for (const RefusalReason reason : kAllRefusalReasons) {
    names.insert(to_string(reason));
  }
  EXPECT_EQ(names.size(), kAllRefusalReasons.size());
  EXPECT_EQ(to_string(RefusalReason::kNone), "registered");
  EXPECT_EQ(to_string(RefusalReason::kTooFewMapMatches), "too_few_map_matches");
}

TEST(RefusalReason, GivesTheOperatorOneDistinctAdvice) {
  std::set<std::string_view> sentences;
  for (const RefusalReason reason : kAllRefusalReasons) {
    const std::string_view text = advice(reason);
    sentences.insert(text);
    if (reason == RefusalReason::kNone) {
      EXPECT_TRUE(text.empty());
      continue;
    }
    EXPECT_GE(text.size(), 40U) << to_string(reason);
    EXPECT_EQ(text.back(), '.') << to_string(reason);
  }
  EXPECT_EQ(sentences.size(), kAllRefusalReasons.size());
}

}  // namespace
}  // namespace trigmesh
