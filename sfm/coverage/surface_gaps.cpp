#include "sfm/coverage/surface_gaps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include "sfm/surface/mesh_topology.hpp"

namespace trigmesh {
namespace {

constexpr std::uint32_t kEnoughViews = 3;
constexpr double kEnoughParallaxRad = 5.0 * std::numbers::pi / 180.0;
constexpr double kSubjectRatio = 0.5;
constexpr double kReliefRatio = 0.75;
constexpr double kInsideRatio = 0.8;
// Pieces are gathered in cubes of this part of the side of a square as large as the subject, but of
// so many mean faces at least.
constexpr double kCellRatio = 1.0 / 30.0;
constexpr double kCellFaces = 8.0;
constexpr double kSameDirectionCosine = 0.766;  // 40 degrees

/// How many views frame the subject at least: half of the median over what the views show. Each
/// view counts, so that wide surroundings in few pictures do not decide.
std::uint32_t least_framing(std::span<const FaceShape> faces,
                            std::span<const FaceCoverage> coverage) {
  std::map<std::uint32_t, double> area_by_views;
  double all = 0.0;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const double shown = faces[f].area * coverage[f].seeing_views;
    area_by_views[coverage[f].framing_views] += shown;
    all += shown;
  }
  double below = 0.0;
  for (const auto& [views, area] : area_by_views) {
    below += area;
    if (2.0 * below >= all) {
      return static_cast<std::uint32_t>(std::ceil(kSubjectRatio * views));
    }
  }
  return 0;
}

bool is_weak(const FaceCoverage& face) {
  return face.seeing_views < kEnoughViews ||
         static_cast<double>(face.parallax_rad) < kEnoughParallaxRad;
}

std::uint32_t framing_views(const Eigen::Vector3d& point, std::span<const DenseView> views) {
  return static_cast<std::uint32_t>(
      std::count_if(views.begin(), views.end(), [&](const DenseView& view) {
        const auto pixel = project(view.camera, view.cam_from_world * point);
        return pixel && pixel->x() >= -0.5 && pixel->y() >= -0.5 &&
               pixel->x() < view.camera.width_px - 0.5 && pixel->y() < view.camera.height_px - 0.5;
      }));
}

/// What is asked of each part of a surface that hangs together.
struct PartShape {
  Eigen::Vector3d area_vector = Eigen::Vector3d::Zero();
  double area = 0.0;
  double longest_border = 0.0;
};

double length_of(const TriangleMesh& mesh, const BoundaryLoop& loop) {
  double length = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    length += (mesh.positions[loop[(i + 1) % loop.size()]] - mesh.positions[loop[i]])
                  .cast<double>()
                  .norm();
  }
  return length;
}

/// Triangles from the middle of a border to its edges, as far as they look where the whole looks.
std::vector<GapPiece> pieces_of_hole(const TriangleMesh& mesh, const BoundaryLoop& loop) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::uint32_t vertex : loop) {
    middle += mesh.positions[vertex].cast<double>() / static_cast<double>(loop.size());
  }
  std::vector<GapPiece> pieces;
  std::vector<Eigen::Vector3d> area_vectors;
  Eigen::Vector3d whole = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector3d a = mesh.positions[loop[i]].cast<double>();
    const Eigen::Vector3d b = mesh.positions[loop[(i + 1) % loop.size()]].cast<double>();
    area_vectors.emplace_back(0.5 * (a - middle).cross(b - middle));
    whole += area_vectors.back();
    pieces.push_back({GapKind::kHole, (a + b + 2.0 * middle) / 4.0, Eigen::Vector3d::Zero(), 0.0});
  }
  const Eigen::Vector3d normal = whole.normalized();
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    pieces[i].normal = normal;
    pieces[i].area = std::max(0.0, area_vectors[i].dot(normal));
  }
  return pieces;
}

/// Everything that is wrong with the subject, piece by piece.
class PieceFinder {
 public:
  PieceFinder(const TriangleMesh& mesh,
              std::span<const DenseView> views,
              std::span<const FaceCoverage> coverage)
      : mesh_(mesh), views_(views), coverage_(coverage), shapes_(mesh.faces.size()) {
    for (std::size_t f = 0; f < shapes_.size(); ++f) {
      shapes_[f] = face_shape(mesh, f);
    }
    least_framing_ = least_framing(shapes_, coverage);
  }

  void add_weak_faces() {
    for (std::size_t f = 0; f < shapes_.size(); ++f) {
      if (coverage_[f].framing_views < least_framing_ || shapes_[f].area <= 0.0) {
        continue;
      }
      subject_area_ += shapes_[f].area;
      ++subject_faces_;
      if (is_weak(coverage_[f])) {
        pieces_.push_back({GapKind::kWeak, shapes_[f].middle, shapes_[f].normal, shapes_[f].area});
      }
    }
  }

  void add_holes() {
    const MeshTopology topology = analyze_topology(mesh_);
    const std::vector<std::uint32_t> part_of_vertex = find_parts();
    for (const BoundaryLoop& loop : topology.boundary_loops) {
      double& longest = parts_[part_of_vertex[loop.front()]].longest_border;
      longest = std::max(longest, length_of(mesh_, loop));
    }
    for (const BoundaryLoop& loop : topology.boundary_loops) {
      if (ends_a_relief(loop, parts_[part_of_vertex[loop.front()]]) || leaves_the_subject(loop)) {
        continue;
      }
      for (const GapPiece& piece : pieces_of_hole(mesh_, loop)) {
        if (piece.area > 0.0) {
          pieces_.push_back(piece);
        }
      }
    }
  }

  [[nodiscard]] const std::vector<GapPiece>& pieces() const { return pieces_; }

  [[nodiscard]] double subject_area() const { return subject_area_; }

  [[nodiscard]] double cell_size() const {
    const double mean_area = subject_area_ / static_cast<double>(subject_faces_);
    return std::sqrt(std::max(kCellRatio * kCellRatio * subject_area_, kCellFaces * mean_area));
  }

 private:
  [[nodiscard]] bool ends_a_relief(const BoundaryLoop& loop, const PartShape& part) const {
    return part.area_vector.norm() > kReliefRatio * part.area &&
           length_of(mesh_, loop) >= part.longest_border;
  }

  /// Whether the surface ends there because the pictures do.
  [[nodiscard]] bool leaves_the_subject(const BoundaryLoop& loop) const {
    const auto inside = std::count_if(loop.begin(), loop.end(), [this](std::uint32_t vertex) {
      const Eigen::Vector3d point = mesh_.positions[vertex].cast<double>();
      return framing_views(point, views_) >= least_framing_;
    });
    return static_cast<double>(inside) < kInsideRatio * static_cast<double>(loop.size());
  }

  std::vector<std::uint32_t> find_parts() {
    const MeshComponents components = find_components(mesh_);
    parts_.resize(components.areas.size());
    std::vector<std::uint32_t> part_of_vertex(mesh_.positions.size(), 0);
    for (std::size_t f = 0; f < shapes_.size(); ++f) {
      const std::uint32_t part = components.component_of_face[f];
      parts_[part].area += shapes_[f].area;
      parts_[part].area_vector += shapes_[f].area * shapes_[f].normal;
      for (const std::uint32_t vertex : mesh_.faces[f]) {
        part_of_vertex[vertex] = part;
      }
    }
    return part_of_vertex;
  }

  const TriangleMesh& mesh_;
  std::span<const DenseView> views_;
  std::span<const FaceCoverage> coverage_;
  std::vector<FaceShape> shapes_;
  std::uint32_t least_framing_ = 0;
  double subject_area_ = 0.0;
  std::size_t subject_faces_ = 0;
  std::vector<PartShape> parts_;
  std::vector<GapPiece> pieces_;
};

/// A cube of space, and one of six directions in which pieces look.
using CellKey = std::array<std::int64_t, 4>;

std::int64_t direction_number(const Eigen::Vector3d& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (normal[axis] < 0.0 ? 1 : 0);
}

/// Joins pieces that look into the same of the six directions and lie in the same or neighbouring
/// cubes.
class Gathering {
 public:
  Gathering(std::span<const GapPiece> pieces, double cell_size) : pieces_(pieces) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const Eigen::Vector3d at = pieces[i].position / cell_size;
      const CellKey key{std::llround(at.x()),
                        std::llround(at.y()),
                        std::llround(at.z()),
                        direction_number(pieces[i].normal)};
      cells_[key].pieces.push_back(i);
    }
    std::size_t number = 0;
    for (auto& [key, cell] : cells_) {
      cell.number = number++;
    }
    parent_.resize(number);
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

  std::vector<SurfaceGap> gather() {
    for (const auto& [key, cell] : cells_) {
      join_neighbors(key, cell);
    }
    std::map<std::size_t, SurfaceGap> by_root;
    for (const auto& [key, cell] : cells_) {
      SurfaceGap& gap = by_root[root_of(cell.number)];
      for (const std::size_t piece : cell.pieces) {
        gap.pieces.push_back(pieces_[piece]);
      }
    }
    std::vector<SurfaceGap> gaps;
    gaps.reserve(by_root.size());
    for (auto& [root, gap] : by_root) {
      gaps.push_back(std::move(gap));
    }
    return gaps;
  }

 private:
  struct Cell {
    std::size_t number = 0;
    std::vector<std::size_t> pieces;
  };

  std::size_t root_of(std::size_t cell) {
    while (parent_[cell] != cell) {
      cell = parent_[cell] = parent_[parent_[cell]];
    }
    return cell;
  }

  void join_neighbors(const CellKey& key, const Cell& cell) {
    for (int step = 0; step < 27; ++step) {
      const auto other = cells_.find(
          {key[0] + step % 3 - 1, key[1] + step / 3 % 3 - 1, key[2] + step / 9 - 1, key[3]});
      if (other != cells_.end()) {
        parent_[root_of(other->second.number)] = root_of(cell.number);
      }
    }
  }

  std::span<const GapPiece> pieces_;
  std::map<CellKey, Cell> cells_;
  std::vector<std::size_t> parent_;
};

SurfaceGap summed_up(std::vector<GapPiece> pieces) {
  SurfaceGap gap;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const GapPiece& piece : pieces) {
    gap.area += piece.area;
    gap.hole_area += piece.kind == GapKind::kHole ? piece.area : 0.0;
    gap.center += piece.area * piece.position;
    normal += piece.area * piece.normal;
  }
  gap.pieces = std::move(pieces);
  gap.center /= gap.area;
  gap.normal = normal.normalized();
  return gap;
}

void sort_by_area(std::vector<SurfaceGap>& gaps) {
  std::stable_sort(gaps.begin(), gaps.end(), [](const SurfaceGap& a, const SurfaceGap& b) {
    return a.area > b.area;
  });
}

/// Whether one photograph would show both: the six directions part what looks between them.
bool belong_together(const SurfaceGap& a, const SurfaceGap& b) {
  return a.normal.dot(b.normal) >= kSameDirectionCosine &&
         (a.center - b.center).norm() <= std::sqrt(a.area + b.area);
}

/// Smaller gaps join the first larger one to which they belong. Gaps by falling area.
std::vector<SurfaceGap> merged(std::vector<SurfaceGap> gaps) {
  std::vector<SurfaceGap> result;
  for (SurfaceGap& gap : gaps) {
    const auto larger = std::find_if(result.begin(), result.end(), [&](const SurfaceGap& other) {
      return belong_together(other, gap);
    });
    if (larger == result.end()) {
      result.push_back(std::move(gap));
      continue;
    }
    gap.pieces.insert(gap.pieces.end(), larger->pieces.begin(), larger->pieces.end());
    *larger = summed_up(std::move(gap.pieces));
  }
  sort_by_area(result);
  return result;
}

}  // namespace

SurfaceGaps find_gaps(const TriangleMesh& mesh,
                      std::span<const DenseView> views,
                      std::span<const FaceCoverage> coverage) {
  PieceFinder finder(mesh, views, coverage);
  finder.add_weak_faces();
  finder.add_holes();
  SurfaceGaps result;
  result.subject_area = finder.subject_area();
  if (finder.pieces().empty() || result.subject_area <= 0.0) {
    return result;
  }
  result.gaps = Gathering(finder.pieces(), finder.cell_size()).gather();
  for (SurfaceGap& gap : result.gaps) {
    gap = summed_up(std::move(gap.pieces));
  }
  sort_by_area(result.gaps);
  result.gaps = merged(std::move(result.gaps));
  return result;
}

}  // namespace trigmesh
