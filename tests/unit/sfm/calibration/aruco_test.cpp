#include "sfm/calibration/aruco.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "firmware/base/file_bytes.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "tests/support/board_renderer.hpp"
#include "tests/support/random.hpp"

namespace trigmesh {
namespace {

using test_support::board_pose;
using test_support::marker_pattern;
using test_support::PlaneRenderer;

constexpr double kSide_m = 0.1;

Camera small_camera() {
  return {.model = CameraModel::kPinhole,
          .width_px = 320,
          .height_px = 240,
          .fx_px = 300.0,
          .fy_px = 300.0,
          .cx_px = 161.3,
          .cy_px = 118.7,
          .distortion = {}};
}

/// Largest distance between found and true corners, pixels.
double corner_error(const MarkerDetection& marker, const Camera& camera, const Rigid3& pose) {
  const std::array<Eigen::Vector3d, 4> corners{Eigen::Vector3d(0.0, 0.0, 0.0),
                                               {kSide_m, 0.0, 0.0},
                                               {kSide_m, kSide_m, 0.0},
                                               {0.0, kSide_m, 0.0}};
  double largest = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    largest =
        std::max(largest, (*project(camera, pose * corners[i]) - marker.corners_px[i]).norm());
  }
  return largest;
}

Rigid3 pose_of(double distance_m, const Eigen::Vector3d& tilt_x_tilt_y_roll_deg) {
  return board_pose({kSide_m, kSide_m}, distance_m, {0.05, -0.03}, tilt_x_tilt_y_roll_deg);
}

TEST(Aruco, CornersAreFoundToAFractionOfAPixelInTheMarkersOwnOrder) {
  const PlaneRenderer renderer(small_camera());
  const MarkerDictionary dictionary{.bits = 4, .count = 50};
  int id = 0;
  for (const Eigen::Vector3d& angles : {Eigen::Vector3d(0, 0, 0),
                                        Eigen::Vector3d(30, 0, 90),
                                        Eigen::Vector3d(0, -40, 180),
                                        Eigen::Vector3d(25, 25, 275),
                                        Eigen::Vector3d(-35, 20, 33)}) {
    const Rigid3 pose = pose_of(0.4, angles);
    const cv::Mat image = renderer.render(marker_pattern(dictionary, id, kSide_m), pose, 2.0, 5);
    const auto markers = detect_markers(image, dictionary);
    ASSERT_TRUE(markers.has_value());
    ASSERT_EQ(markers->size(), 1U) << "id " << id;
    EXPECT_EQ(markers->front().id, id);
    EXPECT_LT(corner_error(markers->front(), small_camera(), pose), 0.15) << "id " << id;
    id += 11;
  }
}

TEST(Aruco, EveryDictionarySizeIsRead) {
  const PlaneRenderer renderer(small_camera());
  for (const MarkerDictionary& dictionary : {MarkerDictionary{.bits = 4, .count = 1000},
                                             MarkerDictionary{.bits = 5, .count = 1000},
                                             MarkerDictionary{.bits = 6, .count = 1000}}) {
    const cv::Mat image = renderer.render(
        marker_pattern(dictionary, 987, kSide_m), pose_of(0.4, {20, 10, 40}), 1.0, 1);
    const auto markers = detect_markers(image, dictionary);
    ASSERT_TRUE(markers.has_value());
    ASSERT_EQ(markers->size(), 1U) << to_string(dictionary);
    EXPECT_EQ(markers->front().id, 987);
  }
}

TEST(Aruco, SmallMarkerOfThreePixelsACellIsRead) {
  const MarkerDictionary dictionary{.bits = 4, .count = 50};
  const Rigid3 pose = pose_of(1.6, {10, 10, 15});
  const cv::Mat image =
      PlaneRenderer(small_camera()).render(marker_pattern(dictionary, 3, kSide_m), pose, 1.0, 1);
  const auto markers = detect_markers(image, dictionary);
  ASSERT_TRUE(markers.has_value());
  ASSERT_EQ(markers->size(), 1U);
  EXPECT_EQ(markers->front().id, 3);
  EXPECT_LT(corner_error(markers->front(), small_camera(), pose), 0.3);
}

TEST(Aruco, NothingIsFoundInNoiseFlatImagesAndMirroredMarkers) {
  const MarkerDictionary dictionary{.bits = 4, .count = 50};
  test_support::Random random(3);
  cv::Mat noise(240, 320, CV_8UC1);
  for (int y = 0; y < noise.rows; ++y) {
    for (int x = 0; x < noise.cols; ++x) {
      noise.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.below(256));
    }
  }
  EXPECT_TRUE(detect_markers(noise, dictionary)->empty());
  EXPECT_TRUE(detect_markers(cv::Mat(240, 320, CV_8UC1, cv::Scalar(130)), dictionary)->empty());
  const auto pattern = marker_pattern(dictionary, 0, kSide_m);
  const auto mirrored = [&](double x, double y) { return pattern(kSide_m - x, y); };
  EXPECT_TRUE(detect_markers(
                  PlaneRenderer(small_camera()).render(mirrored, pose_of(0.4, {0, 0, 0}), 0.0, 1),
                  dictionary)
                  ->empty());
}

TEST(Aruco, WrongArgumentsAreNamed) {
  const auto options = detect_markers(
      cv::Mat(100, 100, CV_8UC1), MarkerDictionary{}, MarkerDetectorOptions{.min_side_px = 2.0});
  ASSERT_FALSE(options.has_value());
  EXPECT_EQ(options.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(options.error().message.find("min_side_px"), std::string::npos);
  EXPECT_FALSE(detect_markers(cv::Mat(), MarkerDictionary{}).has_value());
  EXPECT_FALSE(detect_markers(cv::Mat(100, 100, CV_8UC3), MarkerDictionary{}).has_value());
}

std::filesystem::path data_folder() {
  const char* folder = std::getenv("TRIGMESH_DATA");
  return folder != nullptr ? std::filesystem::path(folder)
                           : std::filesystem::path(TRIGMESH_SOURCE_DIR) / ".." / "shared" / "data";
}

std::map<int, std::array<Eigen::Vector3d, 4>> read_marker_corners(
    const std::filesystem::path& path) {
  std::map<int, std::array<Eigen::Vector3d, 4>> corners;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream values(line);
    int id = 0;
    std::size_t corner = 0;
    Eigen::Vector3d p;
    values >> id >> corner >> p.x() >> p.y() >> p.z();
    corners[id].at(corner) = p;
  }
  return corners;
}

TEST(ArucoOnData, MarkersOfTheOrbitAreFoundNearTheirTrueProjections) {
  const auto folder = data_folder() / "synth_A_orbit";
  if (!std::filesystem::exists(folder)) {
    GTEST_SKIP() << "no synth_A_orbit under " << data_folder() << "; set TRIGMESH_DATA";
  }
  // gt/cameras.txt, pixel centres moved from (0.5, 0.5) to (0, 0).
  const Camera camera{.model = CameraModel::kPinhole,
                      .width_px = 960,
                      .height_px = 720,
                      .fx_px = 864.0,
                      .fy_px = 864.0,
                      .cx_px = 479.5,
                      .cy_px = 359.5,
                      .distortion = {}};
  const auto truth = read_marker_corners(folder / "gt" / "markers.csv");
  std::ifstream images(folder / "gt" / "images.txt");
  std::string line;
  int found = 0;
  int wrong_ids = 0;
  double error_sum = 0.0;
  for (int i = 0; std::getline(images, line);) {
    if (line.empty() || line[0] == '#' || i++ % 6 != 0) {
      continue;
    }
    std::istringstream values(line);
    int image_id = 0;
    int camera_id = 0;
    std::string name;
    Rigid3 pose;
    values >> image_id >> pose.rotation.w() >> pose.rotation.x() >> pose.rotation.y() >>
        pose.rotation.z() >> pose.translation.x() >> pose.translation.y() >> pose.translation.z() >>
        camera_id >> name;
    const auto bytes = read_file_bytes(folder / "images" / name, 10'000'000);
    ASSERT_TRUE(bytes.has_value());
    const auto image = decode_image(*bytes, {.channels = ImageChannels::kGrey});
    ASSERT_TRUE(image.has_value());
    const auto markers = detect_markers(image->grey, {.bits = 4, .count = 50});
    ASSERT_TRUE(markers.has_value());
    for (const MarkerDetection& marker : *markers) {
      const auto corners = truth.find(marker.id);
      if (corners == truth.end()) {
        ++wrong_ids;
        continue;
      }
      for (std::size_t k = 0; k < 4; ++k) {
        error_sum += (*project(camera, pose * corners->second[k]) - marker.corners_px[k]).norm();
        ++found;
      }
    }
  }
  ASSERT_GT(found, 16) << "corners";
  EXPECT_EQ(wrong_ids, 0);
  RecordProperty("mean_error_px", std::to_string(error_sum / found));
  EXPECT_LT(error_sum / found, 0.1) << "pixels, mean of " << found << " corners";
}

}  // namespace
}  // namespace trigmesh
