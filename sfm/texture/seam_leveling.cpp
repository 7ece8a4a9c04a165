// Minimises, for each channel, over an offset g for each (vertex, chart)
//   sum over seam vertices w (f_A + g_A - f_B - g_B)^2
//   + smoothness * sum over edges inside charts (g_i - g_j)^2 + prior * sum g^2
// with f the mean colours along the seam's edges: Lempitsky, Ivanov, "Seamless Mosaicing of
// Image-Based Texture Maps", CVPR 2007, section 4, with the sampling along edges of Waechter,
// Moehrle, Goesele, ECCV 2014, section 4.3. w is lowered where the two pictures show different
// things.
#include "sfm/texture/seam_leveling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "firmware/base/check.hpp"
#include "sfm/texture/mesh_topology.hpp"

namespace trigmesh {
namespace {

constexpr double kSmoothness = 0.1;
constexpr double kPrior = 1e-3;
constexpr float kHonestStep = 20.0F;  // grey levels; larger steps are seen as different content
constexpr int kMostSamples = 24;

struct VertexUse {
  std::uint32_t vertex = 0;
  std::uint32_t chart = 0;
  std::uint32_t face = 0;
  std::uint32_t corner = 0;

  auto operator<=>(const VertexUse&) const = default;
};

/// A node for each (vertex, chart).
struct Nodes {
  std::vector<std::array<std::uint32_t, 3>> of_corner;
  std::uint32_t count = 0;
};

Nodes make_nodes(const TriangleMesh& mesh, const AtlasLayout& layout) {
  std::vector<VertexUse> uses;
  uses.reserve(mesh.faces.size() * 3);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      uses.push_back({mesh.faces[f][k], layout.face_chart[f], static_cast<std::uint32_t>(f), k});
    }
  }
  std::sort(uses.begin(), uses.end());
  Nodes nodes;
  nodes.of_corner.resize(mesh.faces.size());
  for (std::size_t i = 0; i < uses.size(); ++i) {
    const bool same =
        i > 0 && uses[i].vertex == uses[i - 1].vertex && uses[i].chart == uses[i - 1].chart;
    nodes.count += same ? 0 : 1;
    nodes.of_corner[uses[i].face][uses[i].corner] = nodes.count - 1;
  }
  return nodes;
}

/// Where two charts meet at one end of an edge.
struct SeamEnd {
  std::uint32_t node_a = 0;
  std::uint32_t node_b = 0;
  Eigen::Vector3f color_a = Eigen::Vector3f::Zero();  // of the pictures as they are
  Eigen::Vector3f color_b = Eigen::Vector3f::Zero();
  std::uint32_t view_a = 0;
  std::uint32_t view_b = 0;
};

/// Colours at both ends of an edge: means along it, weighted towards the end.
std::array<Eigen::Vector3f, 2> edge_colors(const cv::Mat& page,
                                           const Eigen::Vector2f& from,
                                           const Eigen::Vector2f& to) {
  const int steps = std::clamp(static_cast<int>(std::ceil((to - from).norm())), 1, kMostSamples);
  std::array<Eigen::Vector3f, 2> sums{Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero()};
  float total = 0.0F;
  for (int i = 0; i <= steps; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(steps);
    const Eigen::Vector3f color = sample_bilinear(page, from + t * (to - from));
    sums[0] += (1.0F - t) * color;
    sums[1] += t * color;
    total += t;  // by symmetry the weights of both ends have the same sum
  }
  return {sums[0] / total, sums[1] / total};
}

std::size_t corner_of(const TriangleMesh& mesh, std::uint32_t face, std::uint32_t vertex) {
  const auto& corners = mesh.faces[face];
  return static_cast<std::size_t>(std::find(corners.begin(), corners.end(), vertex) -
                                  corners.begin());
}

std::vector<SeamEnd> find_seams(const TriangleMesh& mesh,
                                const FaceNeighbors& neighbors,
                                const AtlasLayout& layout,
                                const Nodes& nodes,
                                std::span<const cv::Mat> pages) {
  std::vector<SeamEnd> seams;
  for (std::uint32_t a = 0; a < mesh.faces.size(); ++a) {
    for (std::size_t side = 0; side < 3; ++side) {
      const std::uint32_t b = neighbors[a][side];
      if (b == kNoFace || b < a || layout.face_chart[a] == layout.face_chart[b]) {
        continue;
      }
      const Chart& chart_a = layout.charts[layout.face_chart[a]];
      const Chart& chart_b = layout.charts[layout.face_chart[b]];
      if (chart_a.view == kNoLabel || chart_b.view == kNoLabel) {
        continue;
      }
      const std::array<std::size_t, 2> in_a{side, (side + 1) % 3};
      const std::array<std::size_t, 2> in_b{corner_of(mesh, b, mesh.faces[a][in_a[0]]),
                                            corner_of(mesh, b, mesh.faces[a][in_a[1]])};
      const auto colors_a = edge_colors(
          pages[chart_a.page], layout.face_texels[a][in_a[0]], layout.face_texels[a][in_a[1]]);
      const auto colors_b = edge_colors(
          pages[chart_b.page], layout.face_texels[b][in_b[0]], layout.face_texels[b][in_b[1]]);
      for (std::size_t end = 0; end < 2; ++end) {
        seams.push_back({nodes.of_corner[a][in_a[end]],
                         nodes.of_corner[b][in_b[end]],
                         colors_a[end],
                         colors_b[end],
                         chart_a.view,
                         chart_b.view});
      }
    }
  }
  return seams;
}

Eigen::Vector3f gained(const Eigen::Vector3f& color, const ColorGain& gain) {
  return color.cwiseProduct(Eigen::Vector3f(gain[0], gain[1], gain[2]));
}

Eigen::Vector3f gained_step(const SeamEnd& seam, const std::vector<ColorGain>& gains) {
  return gained(seam.color_a, gains[seam.view_a]) - gained(seam.color_b, gains[seam.view_b]);
}

using Offsets = Eigen::Matrix<double, Eigen::Dynamic, 3>;

Offsets solve_offsets(const AtlasLayout& layout,
                      const Nodes& nodes,
                      const std::vector<SeamEnd>& seams,
                      const std::vector<ColorGain>& gains) {
  const auto n = static_cast<Eigen::Index>(nodes.count);
  std::vector<Eigen::Triplet<double, int>> entries;
  entries.reserve(nodes.of_corner.size() * 12 + seams.size() * 4 + nodes.count);
  const auto add_difference = [&](std::uint32_t i, std::uint32_t j, double weight) {
    const auto row = static_cast<int>(std::max(i, j));
    const auto column = static_cast<int>(std::min(i, j));
    entries.emplace_back(row, row, weight);
    entries.emplace_back(column, column, weight);
    entries.emplace_back(row, column, -weight);
  };
  Offsets right = Offsets::Zero(n, 3);
  for (const SeamEnd& seam : seams) {
    const Eigen::Vector3f step = gained_step(seam, gains);
    const float excess = step.cwiseAbs().maxCoeff() / kHonestStep;
    const double weight = 1.0 / (1.0 + static_cast<double>(excess * excess));
    add_difference(seam.node_a, seam.node_b, weight);
    right.row(seam.node_a) -= weight * step.cast<double>().transpose();
    right.row(seam.node_b) += weight * step.cast<double>().transpose();
  }
  for (std::size_t f = 0; f < nodes.of_corner.size(); ++f) {
    if (layout.charts[layout.face_chart[f]].view == kNoLabel) {
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      add_difference(nodes.of_corner[f][k], nodes.of_corner[f][(k + 1) % 3], kSmoothness);
    }
  }
  for (int i = 0; i < static_cast<int>(n); ++i) {
    entries.emplace_back(i, i, kPrior);
  }
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  entries = {};
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver(matrix);
  TM_CHECK(solver.info() == Eigen::Success);  // positive definite because of the prior
  return solver.solve(right);
}

}  // namespace

SeamLeveling level_seams(const TriangleMesh& mesh,
                         const FaceNeighbors& neighbors,
                         const AtlasLayout& layout,
                         const std::vector<ColorGain>& gains,
                         std::span<const cv::Mat> pages) {
  SeamLeveling result;
  result.offsets.assign(
      mesh.faces.size(),
      {Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero()});
  const Nodes nodes = make_nodes(mesh, layout);
  const std::vector<SeamEnd> seams = find_seams(mesh, neighbors, layout, nodes, pages);
  if (seams.empty()) {
    return result;
  }
  const Offsets offsets = solve_offsets(layout, nodes, seams, gains);
  const auto offset = [&](std::uint32_t node) -> Eigen::Vector3f {
    return offsets.row(node).transpose().cast<float>().cwiseMax(-kMostOffset).cwiseMin(kMostOffset);
  };
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      result.offsets[f][k] = offset(nodes.of_corner[f][k]);
    }
  }
  for (const SeamEnd& seam : seams) {
    const Eigen::Vector3f step = gained_step(seam, gains);
    const Eigen::Vector3f left = step + offset(seam.node_a) - offset(seam.node_b);
    result.step_before += static_cast<double>((seam.color_a - seam.color_b).cwiseAbs().mean());
    result.step_after_gains += static_cast<double>(step.cwiseAbs().mean());
    result.step_after += static_cast<double>(left.cwiseAbs().mean());
  }
  const auto count = static_cast<double>(seams.size());
  result.step_before /= count;
  result.step_after_gains /= count;
  result.step_after /= count;
  return result;
}

}  // namespace trigmesh
