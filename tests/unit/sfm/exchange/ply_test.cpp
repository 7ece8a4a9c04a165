#include "sfm/exchange/ply.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/exchange/example_scene.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Ply, ReadsBackExactlyWhatWasWritten) {
  const std::vector<ColoredPoint> points =
      colored_points(test_support::example_scene(CameraModel::kPinhole));
  ASSERT_GE(points.size(), 50U);
  const auto read = read_ply(write_ply(points));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ(*read, points);
}

TEST(Ply, WritesAnEmptyCloudThatCanBeRead) {
  const auto read = read_ply(write_ply({}));
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_TRUE(read->empty());
}

TEST(Ply, WritesFifteenBytesAPointAfterTheHeader) {
  const std::string bytes = write_ply(std::vector<ColoredPoint>(3));
  EXPECT_THAT(bytes, StartsWith("ply\nformat binary_little_endian 1.0\nelement vertex 3\n"));
  const std::string end = "end_header\n";
  EXPECT_EQ(bytes.size() - bytes.find(end) - end.size(), 3U * 15U);
}

TEST(Ply, ReadsAsciiWithForeignPropertiesInAnyOrder) {
  const auto read = read_ply(
      "ply\r\nformat ascii 1.0\r\ncomment made elsewhere\r\nelement face 2\r\n"
      "property list uchar int vertex_indices\r\nelement vertex 2\r\nproperty uchar blue\r\n"
      "property double z\r\nproperty list uchar float weights\r\nproperty float x\r\n"
      "property uchar red\r\nproperty float y\r\nproperty uchar green\r\nend_header\r\n"
      "3 0 1 0\r\n3 1 1 0\r\n"
      "30 3 2 0.5 0.5 1 10 2 20\r\n31 6 0 4 11 5 21\r\n");
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_THAT(
      *read,
      ElementsAre(ColoredPoint{{1, 2, 3}, {10, 20, 30}}, ColoredPoint{{4, 5, 6}, {11, 21, 31}}));
}

TEST(Ply, GivesWhiteToPointsWithoutColour) {
  const auto read = read_ply(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n1 2 3\n");
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_THAT(*read, ElementsAre(ColoredPoint{{1, 2, 3}, {255, 255, 255}}));
}

TEST(Ply, RefusesBigEndianAsUnsupported) {
  const auto read = read_ply(
      "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nend_header\n");
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, ErrorCode::kUnsupported);
}

constexpr const char* kXyz = "property float x\nproperty float y\nproperty float z\n";

struct Hostile {
  const char* name;
  std::string bytes;
  const char* expected_text;
};

class HostilePly : public ::testing::TestWithParam<Hostile> {};

TEST_P(HostilePly, IsCorruptData) {
  const auto read = read_ply(GetParam().bytes);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, ErrorCode::kCorruptData) << read.error().message;
  EXPECT_THAT(read.error().message, HasSubstr(GetParam().expected_text));
}

std::string ascii(const std::string& vertex_line, const std::string& body) {
  return "ply\nformat ascii 1.0\n" + vertex_line + kXyz + "end_header\n" + body;
}

std::string binary(const std::string& header, const std::string& body) {
  return "ply\nformat binary_little_endian 1.0\n" + header + "end_header\n" + body;
}

INSTANTIATE_TEST_SUITE_P(
    All,
    HostilePly,
    ::testing::Values(
        Hostile{"Empty", "", "not a PLY"},
        Hostile{"NoHeaderEnd", "ply\nformat ascii 1.0\n", "no end"},
        Hostile{"NoFormat", "ply\nend_header\n", "format is missing"},
        Hostile{"NoVertices", "ply\nformat ascii 1.0\nend_header\n", "no vertices"},
        Hostile{"NoZ",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                "end_header\n1 2\n",
                "no vertices with x, y and z"},
        Hostile{"UnknownType",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n",
                "line 4"},
        Hostile{"PropertyFirst", "ply\nformat ascii 1.0\nproperty float x\nend_header\n", "line 3"},
        Hostile{
            "HugeCountAscii", ascii("element vertex 18446744073709551615\n", "1 2 3\n"), "short"},
        Hostile{"HugeCountBinary",
                binary(std::string("element vertex 1000000000000\n") + kXyz, "123456789012"),
                "short"},
        Hostile{"NegativeCount", ascii("element vertex -1\n", ""), "'-1'"},
        Hostile{"TooFewLines", ascii("element vertex 3\n", "1 2 3\n4 5 6\n\n\n\n"), "too early"},
        Hostile{"TooFewNumbers", ascii("element vertex 1\n", "1 2\n"), "missing"},
        Hostile{"NotFinite", ascii("element vertex 1\n", "1 2 1e39\n"), "not finite"},
        Hostile{"FloatListLength",
                binary("element face 1\nproperty list float int i\n", "1234"),
                "no integer"},
        Hostile{"NegativeListLength",
                binary(std::string("element face 1\nproperty list char int i\nelement vertex 0\n") +
                           kXyz,
                       "\xff"),
                "negative"},
        Hostile{"HugeListLength",
                binary(std::string("element face 1\nproperty list uint int i\nelement vertex 0\n") +
                           kXyz,
                       "\xff\xff\xff\xff"),
                "longer than the file"}),
    [](const ::testing::TestParamInfo<Hostile>& param) { return std::string(param.param.name); });

TEST(Ply, RefusesEveryTruncation) {
  const std::string whole = write_ply(std::vector<ColoredPoint>(4));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(read_ply(whole.substr(0, length)).has_value()) << length;
  }
}

}  // namespace
}  // namespace trigmesh
