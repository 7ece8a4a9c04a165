#include "sfm/texture/view_labeling.hpp"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "sfm/texture/mesh_topology.hpp"
#include "sfm/texture/minimum_cut.hpp"
#include "tests/unit/sfm/texture/painted_scene.hpp"

namespace trigmesh {
namespace {

LabelingProblem random_problem(unsigned seed, std::uint32_t labels, std::int32_t smoothness) {
  std::mt19937 generator(seed);
  LabelingProblem problem;
  problem.neighbors = face_neighbors(square_mesh(1.0, 2, 0.0));
  problem.label_count = labels;
  problem.smoothness = smoothness;
  problem.offsets.push_back(0);
  for (std::size_t f = 0; f < problem.neighbors.size(); ++f) {
    for (std::uint32_t label = 0; label < labels; ++label) {
      if (label == f % labels || generator() % 3 != 0) {
        problem.candidates.push_back({label, static_cast<std::int32_t>(generator() % 1000)});
      }
    }
    problem.offsets.push_back(problem.candidates.size());
  }
  return problem;
}

std::int64_t brute_force_minimum(const LabelingProblem& problem) {
  std::vector<std::size_t> choice(problem.neighbors.size(), 0);
  std::vector<std::uint32_t> labels(choice.size());
  std::int64_t best = std::numeric_limits<std::int64_t>::max();
  for (;;) {
    for (std::size_t f = 0; f < choice.size(); ++f) {
      labels[f] = problem.of(f)[choice[f]].label;
    }
    best = std::min(best, labeling_energy(problem, labels));
    std::size_t digit = 0;
    while (digit < choice.size() && ++choice[digit] == problem.of(digit).size()) {
      choice[digit++] = 0;
    }
    if (digit == choice.size()) {
      return best;
    }
  }
}

TEST(LabelFaces, FindsTheMinimumOfTwoLabels) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const LabelingProblem problem = random_problem(seed, 2, 150);
    EXPECT_EQ(labeling_energy(problem, label_faces(problem, 10)), brute_force_minimum(problem));
  }
}

TEST(LabelFaces, IsNearTheMinimumOfFourLabels) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const LabelingProblem problem = random_problem(seed, 4, 200);
    const std::int64_t minimum = brute_force_minimum(problem);
    const std::int64_t reached = labeling_energy(problem, label_faces(problem, 10));
    EXPECT_GE(reached, minimum);
    EXPECT_LE(static_cast<double>(reached), 1.25 * static_cast<double>(minimum));
  }
}

TEST(LabelFaces, LeavesFacesWithoutCandidateAlone) {
  LabelingProblem problem;
  problem.neighbors = face_neighbors(square_mesh(1.0, 1, 0.0));
  problem.label_count = 1;
  problem.smoothness = 100;
  problem.offsets = {0, 0, 1};
  problem.candidates = {{0, 5}};
  EXPECT_EQ(label_faces(problem, 2), (std::vector<std::uint32_t>{kNoLabel, 0}));
}

TEST(BinaryCut, EqualsBruteForce) {
  std::mt19937 generator(3);
  for (int round = 0; round < 50; ++round) {
    constexpr std::uint32_t kVariables = 6;
    BinaryCut cut(kVariables);
    std::vector<std::int64_t> energy(1U << kVariables, 0);
    const auto bit = [](std::size_t code, std::uint32_t i) { return (code >> i) & 1U; };
    for (std::uint32_t i = 0; i < kVariables; ++i) {
      const auto zero = static_cast<std::int32_t>(generator() % 50);
      const auto one = static_cast<std::int32_t>(generator() % 50);
      cut.add_unary(i, zero, one);
      for (std::size_t code = 0; code < energy.size(); ++code) {
        energy[code] += bit(code, i) != 0 ? one : zero;
      }
      for (std::uint32_t j = 0; j < i; ++j) {
        const auto different = static_cast<std::int32_t>(generator() % 20);
        const std::int32_t both_zero = generator() % 2 == 0 ? different : 0;
        cut.add_pair(i, j, both_zero, different);
        for (std::size_t code = 0; code < energy.size(); ++code) {
          energy[code] += bit(code, i) != bit(code, j) ? different
                          : bit(code, i) == 0          ? both_zero
                                                       : 0;
        }
      }
    }
    const std::vector<std::uint8_t> x = cut.solve();
    std::size_t code = 0;
    for (std::uint32_t i = 0; i < kVariables; ++i) {
      code |= static_cast<std::size_t>(x[i]) << i;
    }
    EXPECT_EQ(energy[code], *std::min_element(energy.begin(), energy.end()));
  }
}

}  // namespace
}  // namespace trigmesh
