#include "sfm/texture/charts.hpp"

#include <algorithm>
#include <utility>

#include "sfm/texture/mesh_topology.hpp"

namespace trigmesh {
namespace {

bool sees(const FaceViews& faces, std::uint32_t face, std::uint32_t view) {
  const auto views = faces.of(face);
  return std::any_of(
      views.begin(), views.end(), [view](const FaceView& entry) { return entry.view == view; });
}

/// Labels across the border of a component with the number of edges, most edges first.
std::vector<std::pair<int, std::uint32_t>> bordering_labels(const Chart& chart,
                                                            const FaceNeighbors& neighbors,
                                                            std::span<const std::uint32_t> labels) {
  std::vector<std::pair<int, std::uint32_t>> found;  // minus edges, label
  for (const std::uint32_t face : chart.faces) {
    for (const std::uint32_t other : neighbors[face]) {
      if (other == kNoFace || labels[other] == kNoLabel || labels[other] == labels[face]) {
        continue;
      }
      const auto known = std::find_if(found.begin(), found.end(), [&](const auto& entry) {
        return entry.second == labels[other];
      });
      if (known == found.end()) {
        found.emplace_back(-1, labels[other]);
      } else {
        --known->first;
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

std::vector<Chart> connected_charts(std::span<const std::uint32_t> labels,
                                    const FaceNeighbors& neighbors) {
  std::vector<Chart> charts;
  std::vector<std::uint8_t> visited(labels.size(), 0);
  for (std::size_t seed = 0; seed < labels.size(); ++seed) {
    if (visited[seed] != 0 || labels[seed] == kNoLabel) {
      continue;
    }
    Chart& chart = charts.emplace_back();
    chart.view = labels[seed];
    chart.faces.push_back(static_cast<std::uint32_t>(seed));
    visited[seed] = 1;
    for (std::size_t next = 0; next < chart.faces.size(); ++next) {
      for (const std::uint32_t other : neighbors[chart.faces[next]]) {
        if (other != kNoFace && visited[other] == 0 && labels[other] == chart.view) {
          visited[other] = 1;
          chart.faces.push_back(other);
        }
      }
    }
    std::sort(chart.faces.begin(), chart.faces.end());
  }
  return charts;
}

void absorb_small_charts(const FaceViews& faces,
                         const FaceNeighbors& neighbors,
                         std::size_t max_faces,
                         std::vector<std::uint32_t>& labels) {
  for (const Chart& chart : connected_charts(labels, neighbors)) {
    if (chart.faces.size() > max_faces) {
      continue;
    }
    for (const auto& [edges, label] : bordering_labels(chart, neighbors, labels)) {
      const std::uint32_t wanted = label;
      if (std::all_of(chart.faces.begin(), chart.faces.end(), [&](std::uint32_t face) {
            return sees(faces, face, wanted);
          })) {
        for (const std::uint32_t face : chart.faces) {
          labels[face] = wanted;
        }
        break;
      }
    }
  }
}

}  // namespace trigmesh
