#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/exchange/ply.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

DenseCloud example_cloud() {
  return {{.position_in_world = {1.0F, -2.5F, 3.0F},
           .normal_in_world = {0.0F, 0.6F, -0.8F},
           .color_rgb = {10, 20, 255},
           .confidence = 0.75F,
           .view_count = 12},
          {.position_in_world = {-0.125F, 1e-20F, 4e7F},
           .normal_in_world = {1.0F, 0.0F, 0.0F},
           .color_rgb = {0, 0, 0},
           .confidence = 1.0F,
           .view_count = 65535}};
}

std::string ascii(const std::string& properties, const std::string& body) {
  return "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         "property float z\n" +
         properties + "end_header\n" + body;
}

TEST(DensePly, ReadsBackExactlyWhatWasWritten) {
  const auto read = read_dense_ply(write_dense_ply(example_cloud()));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ(*read, example_cloud());
}

TEST(DensePly, WritesAnEmptyCloudThatCanBeRead) {
  const auto read = read_dense_ply(write_dense_ply({}));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_TRUE(read->empty());
}

TEST(DensePly, WritesThirtyThreeBytesAPoint) {
  const std::string bytes = write_dense_ply(example_cloud());
  EXPECT_THAT(bytes,
              StartsWith("ply\nformat binary_little_endian 1.0\nelement vertex 2\n"
                         "property float x\nproperty float y\nproperty float z\n"
                         "property float nx\nproperty float ny\nproperty float nz\n"
                         "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                         "property float confidence\nproperty ushort view_count\nend_header\n"));
  const std::string end = "end_header\n";
  EXPECT_EQ(bytes.size() - bytes.find(end) - end.size(), 2U * 33U);
}

TEST(DensePly, IsReadAsColouredPointsToo) {
  const auto read = read_ply(write_dense_ply(example_cloud()));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ((*read)[1].position_in_world, example_cloud()[1].position_in_world);
  EXPECT_EQ((*read)[0].color_rgb, example_cloud()[0].color_rgb);
}

TEST(DensePly, TakesCloudsOfOtherPrograms) {
  const auto read = read_dense_ply(ascii("", "1 2 3\n"));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  const DensePoint expected{
      .position_in_world = {1.0F, 2.0F, 3.0F}, .color_rgb = {255, 255, 255}, .confidence = 1.0F};
  EXPECT_EQ(read->at(0), expected);
}

TEST(DensePly, RefusesValuesOutOfRange) {
  for (const auto& [properties, body] : std::vector<std::pair<std::string, std::string>>{
           {"property float confidence\n", "1 2 3 1.5\n"},
           {"property float confidence\n", "1 2 3 -0.1\n"},
           {"property int view_count\n", "1 2 3 65536\n"},
           {"property int view_count\n", "1 2 3 -1\n"},
           {"property float nx\n", "1 2 3 1e39\n"},
           {"property float x\n", "1 2 3 4\n"}}) {
    const auto read = read_dense_ply(ascii(properties, body));
    ASSERT_FALSE(read.has_value()) << properties << body;
    EXPECT_EQ(read.error().code, ErrorCode::kCorruptData);
  }
}

TEST(DensePly, RefusesEveryTruncation) {
  const std::string whole = write_dense_ply(example_cloud());
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(read_dense_ply(whole.substr(0, length)).has_value()) << length;
  }
}

}  // namespace
}  // namespace trigmesh
