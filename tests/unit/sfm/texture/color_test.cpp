#include <gtest/gtest.h>

#include "sfm/texture/color_outliers.hpp"
#include "sfm/texture/mesh_topology.hpp"
#include "sfm/texture/view_gains.hpp"

namespace trigmesh {
namespace {

FaceView look(std::uint32_t view, double red, double green, double blue) {
  const auto units = [](double value) { return static_cast<std::uint16_t>(value * 256.0); };
  return {view, 1.0F, {units(red), units(green), units(blue)}};
}

TEST(EstimateViewGains, UndoesExposureAndWhiteBalance) {
  FaceViews faces;
  faces.offsets.push_back(0);
  for (int f = 0; f < 200; ++f) {
    const double value = 60.0 + 0.4 * f;
    faces.entries.push_back(look(0, value, value, value));
    faces.entries.push_back(look(1, 1.3 * value, 1.2 * value, 1.1 * value));
    faces.entries.push_back(look(2, 0.8 * value, 0.8 * value, 0.8 * value));
    if (f % 7 == 0) {  // something else stood there
      faces.entries.back() = look(2, 200.0, 20.0, 20.0);
    }
    faces.offsets.push_back(faces.entries.size());
  }
  const std::vector<ColorGain> gains = estimate_view_gains(faces, 4);
  EXPECT_NEAR(gains[0][0] / gains[1][0], 1.3F, 0.02F);
  EXPECT_NEAR(gains[0][1] / gains[1][1], 1.2F, 0.02F);
  EXPECT_NEAR(gains[0][2] / gains[2][2], 0.8F, 0.02F);
  EXPECT_EQ(gains[3], (ColorGain{1.0F, 1.0F, 1.0F}));
}

const FaceNeighbors kAlone{{kNoFace, kNoFace, kNoFace}};

TEST(RejectColorOutliers, DropsTheOneThatDisagrees) {
  FaceViews faces;
  faces.entries = {look(0, 100, 90, 80),
                   look(1, 103, 92, 79),
                   look(2, 30, 200, 30),
                   look(3, 98, 91, 81),
                   look(4, 101, 88, 83)};
  faces.offsets = {0, 5};
  SerialExecutor executor;
  const std::vector<ColorGain> gains(5, ColorGain{1.0F, 1.0F, 1.0F});
  const OutlierRejection result = reject_color_outliers(faces, kAlone, gains, executor);
  EXPECT_EQ(result.rejected_count, 1U);
  ASSERT_EQ(result.faces.of(0).size(), 4U);
  EXPECT_EQ(result.faces.of(0)[2].view, 3U);
}

/// A strip of faces that five views see; view 2 is `excess` brighter on the faces that `where`
/// names.
template <typename Where>
std::size_t rejected_on_strip(int excess, const Where& where) {
  constexpr std::uint32_t kFaces = 40;
  FaceViews faces;
  FaceNeighbors neighbors;
  faces.offsets = {0};
  for (std::uint32_t f = 0; f < kFaces; ++f) {
    for (std::uint32_t v = 0; v < 5; ++v) {
      const double bright = 100.0 + (v == 2 ? where(f) * excess : 0);
      faces.entries.push_back(look(v, bright, bright, bright));
    }
    faces.offsets.push_back(faces.entries.size());
    neighbors.push_back({f > 0 ? f - 1 : kNoFace, f + 1 < kFaces ? f + 1 : kNoFace, kNoFace});
  }
  SerialExecutor executor;
  const std::vector<ColorGain> gains(5, ColorGain{1.0F, 1.0F, 1.0F});
  return reject_color_outliers(faces, neighbors, gains, executor).rejected_count;
}

TEST(RejectColorOutliers, FinePatternsOffByAPixelStayThingsInTheWayGo) {
  const auto checkered = [](std::uint32_t f) { return f % 2 == 0 ? 1 : -1; };
  EXPECT_EQ(rejected_on_strip(50, checkered), 0U);
  const auto thing = [](std::uint32_t f) { return f >= 10 && f < 30 ? 1 : 0; };
  EXPECT_GE(rejected_on_strip(50, thing), 20U);
  EXPECT_LE(rejected_on_strip(50, thing), 26U);
}

TEST(RejectColorOutliers, ThreeViewsAreTooFewToJudge) {
  FaceViews faces;
  faces.entries = {look(0, 100, 90, 80), look(1, 103, 92, 79), look(2, 110, 105, 95)};
  faces.offsets = {0, 3};
  SerialExecutor executor;
  const std::vector<ColorGain> gains(3, ColorGain{1.0F, 1.0F, 1.0F});
  EXPECT_EQ(reject_color_outliers(faces, kAlone, gains, executor).rejected_count, 0U);
}

}  // namespace
}  // namespace trigmesh
