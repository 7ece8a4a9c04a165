#include "tests/support/board_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "tests/support/random.hpp"

namespace trigmesh::test_support {
namespace {

constexpr double kBlack = 25.0;
constexpr double kWhite = 225.0;
constexpr double kBackground = 120.0;
constexpr int kRaysPerSide = 3;

double light_of(double grey) {
  const double v = grey / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

double grey_of(double light) {
  return 255.0 * (light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1.0 / 2.4) - 0.055);
}

/// Black or white inside a marker; u and v in [0, 1) over its black square.
double marker_value(std::uint64_t pattern, int bits, double u, double v) {
  const int column = static_cast<int>(std::floor(u * (bits + 2))) - 1;
  const int row = static_cast<int>(std::floor(v * (bits + 2))) - 1;
  if (column < 0 || row < 0 || column >= bits || row >= bits) {
    return kBlack;
  }
  return ((pattern >> static_cast<unsigned>(bits * bits - 1 - (row * bits + column))) & 1U) != 0U
             ? kWhite
             : kBlack;
}

/// Marker in each square, -1 where there is none.
std::vector<int> markers_by_square(const Board& board, CharucoLayout layout) {
  std::vector<int> ids(static_cast<std::size_t>(board.columns * board.rows), -1);
  for (int id = 0; id < board.dictionary.count; ++id) {
    if (const auto square = charuco_marker_square(board, layout, id)) {
      ids[static_cast<std::size_t>(square->y() * board.columns + square->x())] = id;
    }
  }
  return ids;
}

}  // namespace

PlanePattern board_pattern(const Board& board, CharucoLayout layout) {
  const int columns = board.corner_columns() + 1;
  const int rows = board.corner_rows() + 1;
  const bool charuco = board.kind == BoardKind::kCharuco;
  const std::vector<int> ids = charuco
                                   ? markers_by_square(board, layout)
                                   : std::vector<int>(static_cast<std::size_t>(columns * rows), -1);
  const int first_black = layout == CharucoLayout::kBlackTopLeft ? 0 : 1;
  return [=](double x_m, double y_m) {
    const double x = x_m / board.square_m + 1.0;
    const double y = y_m / board.square_m + 1.0;
    const int column = static_cast<int>(std::floor(x));
    const int row = static_cast<int>(std::floor(y));
    if (column < 0 || row < 0 || column >= columns || row >= rows) {
      const bool border = x > -1.0 && y > -1.0 && x < columns + 1.0 && y < rows + 1.0;
      return border ? kWhite : kBackground;
    }
    if ((column + row) % 2 == first_black) {
      return kBlack;
    }
    const int id = ids[static_cast<std::size_t>(row * columns + column)];
    if (id < 0) {
      return kWhite;
    }
    const double size = board.marker_m / board.square_m;
    const double u = (x - column - 0.5 * (1.0 - size)) / size;
    const double v = (y - row - 0.5 * (1.0 - size)) / size;
    const bool inside = u >= 0.0 && v >= 0.0 && u < 1.0 && v < 1.0;
    return inside ? marker_value(board.dictionary.pattern(id), board.dictionary.bits, u, v)
                  : kWhite;
  };
}

PlanePattern marker_pattern(const MarkerDictionary& dictionary, int id, double side_m) {
  const std::uint64_t pattern = dictionary.pattern(id);
  const int bits = dictionary.bits;
  return [=](double x_m, double y_m) {
    const double u = x_m / side_m;
    const double v = y_m / side_m;
    if (u >= 0.0 && v >= 0.0 && u < 1.0 && v < 1.0) {
      return marker_value(pattern, bits, u, v);
    }
    const double border = 2.0 / (bits + 2);
    return u > -border && v > -border && u < 1.0 + border && v < 1.0 + border ? kWhite
                                                                              : kBackground;
  };
}

PlaneRenderer::PlaneRenderer(const Camera& camera) : camera_(camera) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int row = 0; row <= camera.height_px; ++row) {
    for (int column = 0; column <= camera.width_px; ++column) {
      corner_rays_.push_back(normalize_pixel(camera, {column - 0.5, row - 0.5})
                                 .value_or(Eigen::Vector2d::Constant(nan)));
    }
  }
}

cv::Mat PlaneRenderer::render(const PlanePattern& pattern,
                              const Rigid3& cam_from_plane,
                              double noise,
                              std::uint64_t seed) const {
  Eigen::Matrix3d cam_from_place = cam_from_plane.rotation.toRotationMatrix();
  cam_from_place.col(2) = cam_from_plane.translation;
  const Eigen::Matrix3d place_from_ray = cam_from_place.inverse();
  std::array<double, 256> light{};
  for (std::size_t i = 0; i < light.size(); ++i) {
    light[i] = light_of(static_cast<double>(i));
  }
  Random random(seed);
  cv::Mat image(camera_.height_px, camera_.width_px, CV_8UC1);
  for (int row = 0; row < camera_.height_px; ++row) {
    for (int column = 0; column < camera_.width_px; ++column) {
      double sum = 0.0;
      for (int k = 0; k < kRaysPerSide * kRaysPerSide; ++k) {
        const double fx = (k % kRaysPerSide + 0.5) / kRaysPerSide;
        const double fy = (k / kRaysPerSide + 0.5) / kRaysPerSide;
        const Eigen::Vector2d direction =
            (1.0 - fy) * ((1.0 - fx) * ray(column, row) + fx * ray(column + 1, row)) +
            fy * ((1.0 - fx) * ray(column, row + 1) + fx * ray(column + 1, row + 1));
        // place ~ (x, y, 1) up to the scale 1 / depth: the plane is in front where that is
        // positive.
        const Eigen::Vector3d place = place_from_ray * direction.homogeneous();
        const double grey =
            place.z() > 0.0 ? pattern(place.x() / place.z(), place.y() / place.z()) : kBackground;
        sum += light[static_cast<std::size_t>(grey)];
      }
      const double value = grey_of(sum / (kRaysPerSide * kRaysPerSide)) +
                           (noise > 0.0 ? noise * random.normal() : 0.0);
      image.at<std::uint8_t>(row, column) =
          static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
    }
  }
  return image;
}

Rigid3 board_pose(const Eigen::Vector2d& size_m,
                  double distance_m,
                  const Eigen::Vector2d& shift,
                  const Eigen::Vector3d& tilt_x_tilt_y_roll_deg) {
  const Eigen::Vector3d angles = tilt_x_tilt_y_roll_deg * std::numbers::pi / 180.0;
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d middle(0.5 * size_m.x(), 0.5 * size_m.y(), 0.0);
  const Eigen::Vector3d target(distance_m * shift.x(), distance_m * shift.y(), distance_m);
  return {.rotation = rotation, .translation = target - rotation * middle};
}

std::vector<Rigid3> varied_board_poses(const Camera& camera,
                                       const Eigen::Vector2d& size_m,
                                       int count) {
  // Distance at which the board fills about 60 % of the image's width.
  const double base = camera.fx_px * size_m.x() / (0.6 * camera.width_px);
  constexpr double kTilt_deg = 30.0;
  std::vector<Rigid3> poses;
  for (int i = 0; i < count; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / count;
    const Eigen::Vector2d shift(0.17 * std::cos(turn) * camera.width_px / camera.fx_px,
                                0.19 * std::sin(turn) * camera.height_px / camera.fx_px);
    // The side towards the middle is the near one, so that the board stays in view.
    const Eigen::Vector3d tilt(kTilt_deg * std::sin(1.7 * turn),
                               kTilt_deg * std::cos(2.3 * turn),
                               15.0 * std::sin(3.1 * turn));
    poses.push_back(board_pose(size_m, base * (1.1 + 0.12 * (i % 4)), shift, tilt));
  }
  return poses;
}

}  // namespace trigmesh::test_support
