#include "sfm/texture/mesh_topology.hpp"

#include <algorithm>
#include <compare>
#include <cstddef>

namespace trigmesh {
namespace {

struct EdgeUse {
  std::uint32_t low = 0;
  std::uint32_t high = 0;
  std::uint32_t face = 0;
  std::uint32_t side = 0;

  auto operator<=>(const EdgeUse&) const = default;
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> face_neighbors(const TriangleMesh& mesh) {
  std::vector<EdgeUse> uses;
  uses.reserve(mesh.faces.size() * 3);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [low, high] = std::minmax(mesh.faces[f][side], mesh.faces[f][(side + 1) % 3]);
      uses.push_back({low, high, static_cast<std::uint32_t>(f), static_cast<std::uint32_t>(side)});
    }
  }
  std::sort(uses.begin(), uses.end());
  std::vector<std::array<std::uint32_t, 3>> neighbors(mesh.faces.size(),
                                                      {kNoFace, kNoFace, kNoFace});
  for (std::size_t begin = 0; begin < uses.size();) {
    std::size_t end = begin + 1;
    while (end < uses.size() && uses[end].low == uses[begin].low &&
           uses[end].high == uses[begin].high) {
      ++end;
    }
    if (end - begin == 2) {
      neighbors[uses[begin].face][uses[begin].side] = uses[begin + 1].face;
      neighbors[uses[begin + 1].face][uses[begin + 1].side] = uses[begin].face;
    }
    begin = end;
  }
  return neighbors;
}

}  // namespace trigmesh
