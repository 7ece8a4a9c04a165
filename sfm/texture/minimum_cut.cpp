#include "sfm/texture/minimum_cut.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

using Graph = boost::compressed_sparse_row_graph<boost::directedS,
                                                 boost::no_property,
                                                 boost::no_property,
                                                 boost::no_property,
                                                 std::uint32_t,
                                                 std::uint32_t>;
using Edge = boost::graph_traits<Graph>::edge_descriptor;

/// Arcs of a flow network in pairs: arc 2k + 1 is the reverse of arc 2k.
struct Arcs {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ends;
  std::vector<std::int32_t> capacities;

  void add(std::uint32_t from, std::uint32_t to, std::int32_t capacity, std::int32_t reverse) {
    ends.emplace_back(from, to);
    ends.emplace_back(to, from);
    capacities.push_back(capacity);
    capacities.push_back(reverse);
  }
};

/// The side of each node after a maximum flow: 1 for those that the source still reaches.
std::vector<std::uint8_t> source_side(const Arcs& arcs, std::uint32_t node_count) {
  // Sorted by their first end, as the compressed graph wants them; positions tell who is whose
  // reverse.
  std::vector<std::uint32_t> begin(node_count + 1, 0);
  for (const auto& ends : arcs.ends) {
    ++begin[ends.first + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> position(arcs.ends.size());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> sorted(arcs.ends.size());
  std::vector<std::int32_t> capacities(arcs.ends.size());
  for (std::size_t i = 0; i < arcs.ends.size(); ++i) {
    position[i] = begin[arcs.ends[i].first]++;
    sorted[position[i]] = arcs.ends[i];
    capacities[position[i]] = arcs.capacities[i];
  }
  const Graph graph(boost::edges_are_sorted, sorted.begin(), sorted.end(), node_count);
  std::vector<Edge> reverse(sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const std::uint32_t twin = position[i ^ 1U];
    reverse[position[i]] = Edge(sorted[twin].first, twin);
  }
  std::vector<std::int32_t> residual(sorted.size());
  std::vector<Edge> predecessors(node_count);
  std::vector<boost::default_color_type> colors(node_count, boost::black_color);
  std::vector<std::int32_t> distances(node_count);
  const auto edge_index = get(boost::edge_index, graph);
  const auto vertex_index = get(boost::vertex_index, graph);
  // Property maps, never raw pointers: with those Boost picks an overload with other meaning.
  boost::boykov_kolmogorov_max_flow(
      graph,
      boost::make_iterator_property_map(capacities.begin(), edge_index),
      boost::make_iterator_property_map(residual.begin(), edge_index),
      boost::make_iterator_property_map(reverse.begin(), edge_index),
      boost::make_iterator_property_map(predecessors.begin(), vertex_index),
      boost::make_iterator_property_map(colors.begin(), vertex_index),
      boost::make_iterator_property_map(distances.begin(), vertex_index),
      vertex_index,
      node_count - 2,
      node_count - 1);
  std::vector<std::uint8_t> side(node_count);
  std::transform(colors.begin(), colors.end(), side.begin(), [](boost::default_color_type color) {
    return static_cast<std::uint8_t>(color == boost::black_color ? 1 : 0);
  });
  return side;
}

}  // namespace

BinaryCut::BinaryCut(std::size_t variable_count) : unary_(variable_count, 0) {}

void BinaryCut::add_unary(std::uint32_t variable, std::int32_t cost0, std::int32_t cost1) {
  unary_[variable] += cost1 - cost0;
}

void BinaryCut::add_pair(std::uint32_t a,
                         std::uint32_t b,
                         std::int32_t both_zero,
                         std::int32_t different) {
  TM_CHECK(both_zero >= 0 && both_zero <= different);
  // E = both_zero - both_zero * b + (different - both_zero) a (1 - b) + different (1 - a) b
  unary_[b] -= both_zero;
  links_.push_back({a, b, different - both_zero, different});
}

std::vector<std::uint8_t> BinaryCut::solve() const {
  const auto n = static_cast<std::uint32_t>(unary_.size());
  const std::uint32_t source = n;
  const std::uint32_t sink = n + 1;
  Arcs arcs;
  arcs.ends.reserve(2 * (unary_.size() + links_.size()));
  arcs.capacities.reserve(2 * (unary_.size() + links_.size()));
  for (std::uint32_t i = 0; i < n; ++i) {
    // Source side = 1. A variable that wants 0 (unary > 0) pays for being on the source side.
    if (unary_[i] > 0) {
      arcs.add(i, sink, unary_[i], 0);
    } else if (unary_[i] < 0) {
      arcs.add(source, i, -unary_[i], 0);
    }
  }
  for (const Link& link : links_) {
    arcs.add(link.from, link.to, link.capacity, link.reverse_capacity);
  }
  std::vector<std::uint8_t> side = source_side(arcs, n + 2);
  side.resize(n);
  return side;
}

}  // namespace trigmesh
