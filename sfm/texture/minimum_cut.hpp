#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace trigmesh {

/// Minimises a function of binary variables x_i with unary terms and pairwise terms of Potts form
/// by a minimum cut. Add all terms, then solve once.
class BinaryCut {
 public:
  explicit BinaryCut(std::size_t variable_count);

  /// Adds cost0 if x = 0, cost1 if x = 1.
  void add_unary(std::uint32_t variable, std::int32_t cost0, std::int32_t cost1);
  /// Adds `both_zero` if a = b = 0, `different` if a != b, nothing if a = b = 1.
  /// 0 <= both_zero <= different.
  void add_pair(std::uint32_t a, std::uint32_t b, std::int32_t both_zero, std::int32_t different);
  /// The x of a minimum; 0 wherever a minimum with 0 exists.
  [[nodiscard]] std::vector<std::uint8_t> solve() const;

 private:
  struct Link {
    std::uint32_t from = 0;
    std::uint32_t to = 0;
    std::int32_t capacity = 0;
    std::int32_t reverse_capacity = 0;
  };

  std::vector<std::int32_t> unary_;  // cost1 - cost0
  std::vector<Link> links_;
};

}  // namespace trigmesh
