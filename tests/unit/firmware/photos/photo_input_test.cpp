#include "firmware/photos/photo_input.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/demo_session.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using test_support::DemoStore;
using ::testing::ElementsAre;
using ::testing::StartsWith;

TEST(PhotoInput, ASessionIsCalledByItsIdWhateverItsFolderIsCalled) {
  DemoStore store;
  auto pictures = test_support::demo_pictures(32);
  const std::string id = store.add(pictures, "");
  const fs::path renamed = store.folder_of(id).parent_path() / "renamed";
  fs::copy(store.folder_of(id), renamed, fs::copy_options::recursive);
  const auto photos = open_photos(renamed.string(), Subfolders::kIgnore, MaskUse::kUse);
  ASSERT_TRUE(photos) << photos.error().message;
  EXPECT_THAT(photos->description, StartsWith(id + ": session, 2 photographs"));
  EXPECT_THAT(photos->names, ElementsAre("000001.jpg", "000002.jpg"));
  EXPECT_EQ(*photos->read(1), pictures[1]);
  EXPECT_TRUE(photos->timestamps.empty()) << "its frames were chosen already";
}

TEST(PhotoInput, FramesWithoutAManifestAreAFolderOfFrames) {
  DemoStore store;
  const std::string id = store.add(test_support::demo_pictures(32), "");
  fs::remove(store.folder_of(id) / "session.json");
  const auto photos = open_photos(store.folder_of(id).string(), Subfolders::kIgnore, MaskUse::kUse);
  ASSERT_TRUE(photos) << photos.error().message;
  EXPECT_FALSE(photos->is_walk);
}

}  // namespace
}  // namespace trigmesh
