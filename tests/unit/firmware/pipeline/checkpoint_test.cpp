#include "firmware/pipeline/checkpoint.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

constexpr std::uint64_t kKey = 42;

class Checkpoints : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = CheckpointFolder::open(folder_);
    ASSERT_TRUE(opened) << opened.error().message;
    checkpoints_ = std::move(*opened);
    ASSERT_TRUE(checkpoints_->save("piece", kKey, payload_));
  }

  [[nodiscard]] std::string stored() const {
    std::ifstream file(folder_ / "piece", std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  void store(const std::string& bytes) const {
    std::ofstream(folder_ / "piece", std::ios::binary | std::ios::trunc) << bytes;
  }

  const test_support::TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path() / "checkpoints";
  std::optional<CheckpointFolder> checkpoints_;
  const std::vector<std::uint8_t> payload_{1, 2, 3, 250, 0, 7};
};

TEST_F(Checkpoints, GiveBackWhatWasSavedUnderTheSameKey) {
  EXPECT_EQ(checkpoints_->load("piece", kKey), payload_);
}

TEST_F(Checkpoints, KnowNothingUnderAnotherKeyOrName) {
  EXPECT_FALSE(checkpoints_->load("piece", kKey + 1));
  EXPECT_FALSE(checkpoints_->load("other", kKey));
}

TEST_F(Checkpoints, AreNothingWhenTornAnywhere) {
  const std::string whole = stored();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    store(whole.substr(0, length));
    EXPECT_FALSE(checkpoints_->load("piece", kKey)) << "cut to " << length << " bytes";
  }
}

TEST_F(Checkpoints, AreNothingWhenAnyByteIsDamaged) {
  const std::string whole = stored();
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    store(damaged);
    EXPECT_FALSE(checkpoints_->load("piece", kKey)) << "byte " << i;
  }
}

TEST_F(Checkpoints, AreGoneAfterDiscard) {
  checkpoints_->discard();
  EXPECT_FALSE(std::filesystem::exists(folder_));
  EXPECT_FALSE(checkpoints_->load("piece", kKey));
}

TEST_F(Checkpoints, CannotBeOpenedBelowAFile) {
  const auto opened = CheckpointFolder::open(folder_ / "piece" / "work");
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kIo);
}

TEST_F(Checkpoints, CannotBeSavedIntoAFolderThatIsGone) {
  std::filesystem::remove_all(folder_);
  EXPECT_FALSE(checkpoints_->save("piece", kKey, payload_));
}

}  // namespace
}  // namespace trigmesh
