#include "firmware/pipeline/model_writer.hpp"

#include <cstdlib>
#include <fstream>
#include <string>
#include <system_error>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

std::string contents(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

class ExtendModel : public testing::Test {
 protected:
  const test_support::TemporaryFolder temporary_;
  const fs::path output_ = temporary_.path();
  ModelFolder place_{output_};
};

TEST_F(ExtendModel, KeepsWhatIsThereAndAddsOrReplaces) {
  const ReconstructionReport report = build_report({});
  ASSERT_TRUE(write_model(place_, std::vector<Scene>(1), report));
  const std::string images = contents(output_ / "model/sparse/images.txt");
  const std::vector<NamedFile> first{{"dense.ply", "points"}, {"mesh.ply", "old"}};
  ASSERT_TRUE(extend_model(place_, first, {}, report));
  const std::vector<NamedFile> second{{"mesh.ply", "new"}};
  ASSERT_TRUE(extend_model(place_, second, {}, report));
  EXPECT_EQ(contents(output_ / "model/sparse/images.txt"), images);
  EXPECT_EQ(contents(output_ / "model/dense.ply"), "points");
  EXPECT_EQ(contents(output_ / "model/mesh.ply"), "new");
  EXPECT_FALSE(fs::exists(output_ / ".model.part"));
}

TEST_F(ExtendModel, RenewsAFolderAsAWhole) {
  const ReconstructionReport report = build_report({});
  ASSERT_TRUE(write_model(place_, std::vector<Scene>(1), report));
  const std::vector<NamedFile> first{{"masks/left/a.png", "a"}, {"masks/b.png", "b"}};
  ASSERT_TRUE(extend_model(place_, first, {}, report));
  EXPECT_EQ(contents(output_ / "model/masks/left/a.png"), "a");
  const std::vector<NamedFile> second{{"masks/b.png", "new"}};
  ASSERT_TRUE(extend_model(place_, second, {}, report, {}, "masks"));
  EXPECT_FALSE(fs::exists(output_ / "model/masks/left"));
  EXPECT_EQ(contents(output_ / "model/masks/b.png"), "new");
}

TEST_F(ExtendModel, NeedsAModel) {
  const auto result = extend_model(place_, {}, {}, build_report({}));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kIo);
  EXPECT_FALSE(fs::exists(output_ / ".model.part"));
}

}  // namespace
}  // namespace trigmesh
