#include "tests/support/textured_globe.hpp"

#include <cmath>
#include <numbers>

namespace trigmesh::test_support {
namespace {

const Eigen::Vector3d kCenter(0.0, 0.0, 3.0);

/// South is +y, because y points down in the world.
Eigen::Vector3d direction(double latitude_rad, double longitude_rad) {
  return {std::cos(latitude_rad) * std::cos(longitude_rad),
          -std::sin(latitude_rad),
          std::cos(latitude_rad) * std::sin(longitude_rad)};
}

cv::Mat page_picture(int size_px, bool is_warm) {
  constexpr int kFields = 8;
  cv::Mat page(size_px, size_px, CV_8UC3);
  for (int y = 0; y < size_px; ++y) {
    for (int x = 0; x < size_px; ++x) {
      const int column = x * kFields / size_px;
      const int row = y * kFields / size_px;
      const auto level = static_cast<std::uint8_t>((column + row) % 2 == 0 ? 230 : 120);
      const auto slope = static_cast<std::uint8_t>(40 + 20 * column);
      cv::Vec3b color = is_warm ? cv::Vec3b(level, slope, 40) : cv::Vec3b(40, slope, level);
      if (column == 0 && row == 0) {
        color = cv::Vec3b(255, 255, 255);
      }
      page.at<cv::Vec3b>(y, x) = color;
    }
  }
  return page;
}

/// Vertex of ring `ring` (0 = north pole) and sector `sector`; the poles are one vertex each.
class Grid {
 public:
  explicit Grid(const TexturedGlobeOptions& options) : options_(options) {}

  [[nodiscard]] std::uint32_t vertex(int ring, int sector) const {
    if (ring == 0) {
      return 0;
    }
    if (ring == options_.rings) {
      return 1;
    }
    return static_cast<std::uint32_t>(2 + (ring - 1) * options_.sectors +
                                      sector % options_.sectors);
  }

  [[nodiscard]] double latitude(int ring) const {
    return std::numbers::pi * (0.5 - static_cast<double>(ring) / options_.rings);
  }

  [[nodiscard]] double longitude(int sector) const {
    return 2.0 * std::numbers::pi * sector / options_.sectors;
  }

  /// In the page of its half: u along the longitude, v from the upper to the lower ring.
  [[nodiscard]] Eigen::Vector2f uv(int ring, int sector, bool is_upper) const {
    const int half = options_.rings / 2;
    const double v = static_cast<double>(is_upper ? ring : ring - half) / half;
    return {static_cast<float>(static_cast<double>(sector) / options_.sectors),
            static_cast<float>(v)};
  }

 private:
  TexturedGlobeOptions options_;
};

struct Corner {
  int ring;
  int sector;
};

void add_face(TexturedMesh& globe, const Grid& grid, std::array<Corner, 3> corners, bool is_upper) {
  std::array<std::uint32_t, 3> face{};
  std::array<Eigen::Vector2f, 3> uv;
  for (std::size_t i = 0; i < 3; ++i) {
    face[i] = grid.vertex(corners[i].ring, corners[i].sector);
    uv[i] = grid.uv(corners[i].ring, corners[i].sector, is_upper);
  }
  globe.mesh.faces.push_back(face);
  globe.face_uv.push_back(uv);
  globe.face_page.push_back(is_upper ? 0 : 1);
}

}  // namespace

TexturedMesh make_textured_globe(const TexturedGlobeOptions& options) {
  const Grid grid(options);
  TexturedMesh globe;
  globe.mesh.normals = {direction(grid.latitude(0), 0).cast<float>(),
                        direction(grid.latitude(options.rings), 0).cast<float>()};
  for (int ring = 1; ring < options.rings; ++ring) {
    for (int sector = 0; sector < options.sectors; ++sector) {
      globe.mesh.normals.push_back(
          direction(grid.latitude(ring), grid.longitude(sector)).cast<float>());
    }
  }
  for (const Eigen::Vector3f& normal : globe.mesh.normals) {
    globe.mesh.positions.push_back(
        (kCenter + options.radius * normal.cast<double>()).cast<float>());
  }
  for (int ring = 0; ring < options.rings; ++ring) {
    const bool is_upper = ring < options.rings / 2;
    for (int sector = 0; sector < options.sectors; ++sector) {
      const Corner a{ring, sector};
      const Corner b{ring, sector + 1};
      const Corner c{ring + 1, sector + 1};
      const Corner d{ring + 1, sector};
      if (ring + 1 < options.rings) {
        add_face(globe, grid, {a, d, c}, is_upper);
      }
      if (ring > 0) {
        add_face(globe,
                 grid,
                 ring + 1 < options.rings ? std::array{a, c, b} : std::array{a, d, b},
                 is_upper);
      }
    }
  }
  globe.pages = {page_picture(options.page_size_px, true),
                 page_picture(options.page_size_px, false)};
  return globe;
}

}  // namespace trigmesh::test_support
