#include "sfm/surface/hole_patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <Eigen/Geometry>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

constexpr int kMaxRefinements = 12;
constexpr int kFairingSteps = 200;
// Largest stable step of the explicit second-order umbrella flow is 1/2 for the normalised operator
// applied twice (its eigenvalues are within [0, 4]).
constexpr float kFairingStep = 0.4F;
// Triangles with more than this many times the area of an equilateral one are split.
constexpr float kSplitAreaRatio = 2.0F;

float area(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  return 0.5F * (b - a).cross(c - a).norm();
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

Edge edge_of(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

/// Cosine of the angle at `tip`.
float corner_cosine(const Eigen::Vector3f& tip,
                    const Eigen::Vector3f& a,
                    const Eigen::Vector3f& b) {
  const Eigen::Vector3f to_a = a - tip;
  const Eigen::Vector3f to_b = b - tip;
  return to_a.dot(to_b) / std::max(to_a.norm() * to_b.norm(), 1e-30F);
}

/// The corner of a face that is not on an edge.
std::uint32_t tip_of(const std::array<std::uint32_t, 3>& face, const Edge& edge) {
  for (const std::uint32_t v : face) {
    if (v != edge.first && v != edge.second) {
      return v;
    }
  }
  TM_CHECK(false);
  return 0;
}

/// Turns the face so that it starts with the corner after `tip`.
std::array<std::uint32_t, 3> opposite_first(const std::array<std::uint32_t, 3>& face,
                                            std::uint32_t tip) {
  std::array<std::uint32_t, 3> turned = face;
  while (turned[2] != tip) {
    std::rotate(turned.begin(), turned.begin() + 1, turned.end());
  }
  return turned;
}

std::map<Edge, std::vector<std::size_t>> faces_of_edges(const HolePatch& patch) {
  std::map<Edge, std::vector<std::size_t>> faces;
  for (std::size_t f = 0; f < patch.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      faces[edge_of(patch.faces[f][k], patch.faces[f][(k + 1) % 3])].push_back(f);
    }
  }
  return faces;
}

/// One sweep of flips to the diagonal whose opposite angles sum to less than 180 degrees.
void flip_edges(HolePatch& patch) {
  const auto edges = faces_of_edges(patch);
  std::vector<std::uint8_t> touched(patch.faces.size(), 0);
  for (const auto& [edge, faces] : edges) {
    if (faces.size() != 2 || touched[faces[0]] != 0 || touched[faces[1]] != 0) {
      continue;
    }
    const std::uint32_t p = tip_of(patch.faces[faces[0]], edge);
    const std::uint32_t q = tip_of(patch.faces[faces[1]], edge);
    const auto& points = patch.points;
    const float at_tips =
        std::acos(std::clamp(
            corner_cosine(points[p], points[edge.first], points[edge.second]), -1.0F, 1.0F)) +
        std::acos(std::clamp(
            corner_cosine(points[q], points[edge.first], points[edge.second]), -1.0F, 1.0F));
    const auto turned = opposite_first(patch.faces[faces[0]], p);  // from a to b, tip p
    const std::uint32_t a = turned[0];
    const std::uint32_t b = turned[1];
    const Eigen::Vector3f first = (points[q] - points[a]).cross(points[p] - points[a]);
    const Eigen::Vector3f second = (points[p] - points[b]).cross(points[q] - points[b]);
    constexpr float kHalfTurn = 3.15F;
    if (at_tips > kHalfTurn && p != q && edges.count(edge_of(p, q)) == 0 &&
        first.dot(second) > 0.0F) {
      patch.faces[faces[0]] = {a, q, p};
      patch.faces[faces[1]] = {b, p, q};
      touched[faces[0]] = 1;
      touched[faces[1]] = 1;
    }
  }
}

std::size_t split_large(float edge_length, HolePatch& patch) {
  const float limit = kSplitAreaRatio * 0.433F * edge_length * edge_length;
  const std::size_t count = patch.faces.size();
  std::size_t splits = 0;
  for (std::size_t f = 0; f < count; ++f) {
    const std::array<std::uint32_t, 3> face = patch.faces[f];
    const Eigen::Vector3f& a = patch.points[face[0]];
    const Eigen::Vector3f& b = patch.points[face[1]];
    const Eigen::Vector3f& c = patch.points[face[2]];
    if (area(a, b, c) <= limit) {
      continue;
    }
    const auto center = static_cast<std::uint32_t>(patch.points.size());
    patch.points.emplace_back((a + b + c) / 3.0F);
    patch.parents.push_back(face);
    patch.faces[f] = {face[0], face[1], center};
    patch.faces.push_back({face[1], face[2], center});
    patch.faces.push_back({face[2], face[0], center});
    ++splits;
  }
  return splits;
}

/// Triangles of the span [first, last] of the border from the table of best middles.
void collect(const std::vector<std::uint32_t>& middles,
             std::size_t n,
             std::uint32_t first,
             std::uint32_t last,
             HolePatch& patch) {
  if (last - first < 2) {
    return;
  }
  const std::uint32_t middle = middles[first * n + last];
  patch.faces.push_back({first, middle, last});
  collect(middles, n, first, middle, patch);
  collect(middles, n, middle, last, patch);
}

}  // namespace

HolePatch minimal_area_patch(const std::vector<Eigen::Vector3f>& border) {
  const std::size_t n = border.size();
  TM_CHECK(n >= 3);
  std::vector<float> cost(n * n, 0.0F);
  std::vector<std::uint32_t> middles(n * n, 0);
  for (std::size_t span = 2; span < n; ++span) {
    for (std::size_t first = 0; first + span < n; ++first) {
      const std::size_t last = first + span;
      float best = std::numeric_limits<float>::infinity();
      for (std::size_t middle = first + 1; middle < last; ++middle) {
        const float sum = cost[first * n + middle] + cost[middle * n + last] +
                          area(border[first], border[middle], border[last]);
        if (sum < best) {
          best = sum;
          middles[first * n + last] = static_cast<std::uint32_t>(middle);
        }
      }
      cost[first * n + last] = best;
    }
  }
  HolePatch patch;
  patch.points = border;
  patch.border_count = n;
  collect(middles, n, 0, static_cast<std::uint32_t>(n - 1), patch);
  return patch;
}

void refine(float edge_length, HolePatch& patch) {
  for (int round = 0; round < kMaxRefinements; ++round) {
    const bool grew = split_large(edge_length, patch) > 0;
    flip_edges(patch);
    flip_edges(patch);
    if (!grew) {
      return;
    }
  }
}

void fair(const std::vector<Eigen::Vector3f>& anchors, HolePatch& patch) {
  TM_CHECK(anchors.size() == patch.border_count);
  const std::size_t count = patch.points.size();
  const auto umbrella = [&](const std::vector<Eigen::Vector3f>& values) {
    std::vector<Eigen::Vector3f> sums(count, Eigen::Vector3f::Zero());
    std::vector<float> counts(count, 0.0F);
    for (const auto& face : patch.faces) {
      for (std::size_t k = 0; k < 3; ++k) {
        sums[face[k]] += values[face[(k + 1) % 3]] + values[face[(k + 2) % 3]];
        counts[face[k]] += 2.0F;
      }
    }
    for (std::size_t v = 0; v < count; ++v) {
      sums[v] = sums[v] / std::max(counts[v], 1.0F) - values[v];
    }
    return sums;
  };
  // A border point bends by what is around it on both sides.
  const auto bending = [&] {
    std::vector<Eigen::Vector3f> first = umbrella(patch.points);
    for (std::size_t v = 0; v < patch.border_count; ++v) {
      first[v] = 0.5F * (first[v] + anchors[v] - patch.points[v]);
    }
    return first;
  };
  for (int step = 0; step < kFairingSteps; ++step) {
    const std::vector<Eigen::Vector3f> second = umbrella(bending());
    for (std::size_t v = patch.border_count; v < count; ++v) {
      patch.points[v] -= kFairingStep * second[v];
    }
  }
}

}  // namespace trigmesh
