// Boykov, Veksler, Zabih, "Fast Approximate Energy Minimization via Graph Cuts", PAMI 2001
// (expansion moves), with the graph of Kolmogorov, Zabih, "What Energy Functions can be Minimized
// via Graph Cuts?", PAMI 2004, section 4; the energy is that of Lempitsky, Ivanov, "Seamless
// Mosaicing of Image-Based Texture Maps", CVPR 2007, with a Potts term.
#include "sfm/texture/view_labeling.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/base/check.hpp"
#include "sfm/texture/mesh_topology.hpp"
#include "sfm/texture/minimum_cut.hpp"

namespace trigmesh {
namespace {

constexpr std::int32_t kNotACandidate = -1;

std::int32_t cost_of(const LabelingProblem& problem, std::size_t face, std::uint32_t label) {
  for (const LabelCandidate& candidate : problem.of(face)) {
    if (candidate.label == label) {
      return candidate.cost;
    }
  }
  return kNotACandidate;
}

/// One expansion move: every face may switch to `alpha` or stay.
class ExpansionMove {
 public:
  ExpansionMove(const LabelingProblem& problem,
                std::vector<std::uint32_t>& labels,
                std::vector<std::uint32_t>& node_of_face)
      : problem_(problem), labels_(labels), node_of_face_(node_of_face) {}

  /// True when a label changed. `members` are the faces that have `alpha` as candidate.
  bool run(std::uint32_t alpha, std::span<const std::uint32_t> members) {
    collect_nodes(alpha, members);
    if (faces_.empty()) {
      return false;
    }
    BinaryCut cut(faces_.size());
    for (std::uint32_t node = 0; node < faces_.size(); ++node) {
      add_face(alpha, node, cut);
    }
    const std::vector<std::uint8_t> switched = cut.solve();
    bool changed = false;
    for (std::size_t node = 0; node < faces_.size(); ++node) {
      node_of_face_[faces_[node]] = kNoFace;
      if (switched[node] != 0) {
        labels_[faces_[node]] = alpha;
        changed = true;
      }
    }
    return changed;
  }

 private:
  void collect_nodes(std::uint32_t alpha, std::span<const std::uint32_t> members) {
    faces_.clear();
    for (const std::uint32_t face : members) {
      if (labels_[face] != alpha) {
        node_of_face_[face] = static_cast<std::uint32_t>(faces_.size());
        faces_.push_back(face);
      }
    }
  }

  void add_face(std::uint32_t alpha, std::uint32_t node, BinaryCut& cut) {
    const std::uint32_t face = faces_[node];
    const std::uint32_t label = labels_[face];
    cut.add_unary(node, cost_of(problem_, face, label), cost_of(problem_, face, alpha));
    for (const std::uint32_t other : problem_.neighbors[face]) {
      if (other == kNoFace || labels_[other] == kNoLabel) {
        continue;
      }
      const std::int32_t stay_stay = labels_[other] != label ? problem_.smoothness : 0;
      const std::uint32_t other_node = node_of_face_[other];
      if (other_node == kNoFace) {
        // The neighbour keeps its label whatever happens here.
        const std::int32_t switch_stay = labels_[other] != alpha ? problem_.smoothness : 0;
        cut.add_unary(node, stay_stay, switch_stay);
      } else if (other > face) {
        cut.add_pair(node, other_node, stay_stay, problem_.smoothness);
      }
    }
  }

  const LabelingProblem& problem_;
  std::vector<std::uint32_t>& labels_;
  std::vector<std::uint32_t>& node_of_face_;  // kNoFace outside of run()
  std::vector<std::uint32_t> faces_;
};

std::vector<std::uint32_t> cheapest_labels(const LabelingProblem& problem) {
  std::vector<std::uint32_t> labels(problem.neighbors.size(), kNoLabel);
  for (std::size_t f = 0; f < labels.size(); ++f) {
    const auto candidates = problem.of(f);
    const auto best =
        std::min_element(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
          return a.cost < b.cost;
        });
    if (best != candidates.end()) {
      labels[f] = best->label;
    }
  }
  return labels;
}

}  // namespace

LabelingProblem make_labeling_problem(const FaceViews& faces,
                                      std::vector<std::array<std::uint32_t, 3>> neighbors,
                                      std::uint32_t view_count,
                                      std::int32_t smoothness,
                                      std::size_t max_candidates) {
  TM_CHECK(neighbors.size() == faces.face_count());
  LabelingProblem problem;
  problem.neighbors = std::move(neighbors);
  problem.label_count = view_count;
  problem.smoothness = smoothness;
  problem.offsets.assign(1, 0);
  for (std::size_t f = 0; f < faces.face_count(); ++f) {
    const auto views = faces.of(f);
    std::vector<FaceView> best(views.begin(), views.end());
    std::sort(best.begin(), best.end(), [](const FaceView& a, const FaceView& b) {
      return a.quality != b.quality ? a.quality > b.quality : a.view < b.view;
    });
    best.resize(std::min(best.size(), max_candidates));
    const float highest = best.empty() ? 1.0F : best.front().quality;
    std::sort(best.begin(), best.end(), [](const FaceView& a, const FaceView& b) {
      return a.view < b.view;
    });
    for (const FaceView& view : best) {
      const float loss = 1.0F - std::sqrt(view.quality / highest);
      problem.candidates.push_back(
          {view.view,
           static_cast<std::int32_t>(std::lround(loss * static_cast<float>(kLargestLabelCost)))});
    }
    problem.offsets.push_back(problem.candidates.size());
  }
  return problem;
}

std::int64_t labeling_energy(const LabelingProblem& problem,
                             std::span<const std::uint32_t> labels) {
  std::int64_t energy = 0;
  for (std::size_t f = 0; f < labels.size(); ++f) {
    if (labels[f] == kNoLabel) {
      continue;
    }
    energy += cost_of(problem, f, labels[f]);
    for (const std::uint32_t other : problem.neighbors[f]) {
      if (other != kNoFace && other > f && labels[other] != kNoLabel &&
          labels[other] != labels[f]) {
        energy += problem.smoothness;
      }
    }
  }
  return energy;
}

std::vector<std::uint32_t> label_faces(const LabelingProblem& problem, int sweeps) {
  std::vector<std::vector<std::uint32_t>> members(problem.label_count);
  for (std::size_t f = 0; f < problem.neighbors.size(); ++f) {
    for (const LabelCandidate& candidate : problem.of(f)) {
      members[candidate.label].push_back(static_cast<std::uint32_t>(f));
    }
  }
  std::vector<std::uint32_t> labels = cheapest_labels(problem);
  std::vector<std::uint32_t> node_of_face(labels.size(), kNoFace);
  ExpansionMove move(problem, labels, node_of_face);
  bool changed = true;
  for (int sweep = 0; sweep < sweeps && changed; ++sweep) {
    changed = false;
    for (std::uint32_t alpha = 0; alpha < problem.label_count; ++alpha) {
      changed = move.run(alpha, members[alpha]) || changed;
    }
  }
  return labels;
}

}  // namespace trigmesh
