#pragma once

#include <cstdint>
#include <optional>

namespace trigmesh {

/// Turns the 32 bit sequence numbers of a driver, which wrap and begin anywhere, into numbers from
/// 0 and a count of what is missing. Thread-compatible.
class FrameSequence {
 public:
  /// What one number says.
  struct Place {
    std::uint64_t sequence = 0;
    std::uint64_t missed_before = 0;
  };

  /// A number that does not go up (drivers that always say 0, or that begin anew) counts as the
  /// next one: nothing is known to be missing.
  [[nodiscard]] Place place(std::uint32_t number) {
    if (!last_) {
      last_ = number;
      return {};
    }
    constexpr std::uint32_t kHalf = 1U << 31U;
    const std::uint32_t ahead = number - *last_;  // unsigned: right across the wrap
    const std::uint64_t step = ahead == 0 || ahead >= kHalf ? 1 : ahead;
    last_ = number;
    sequence_ += step;
    return {sequence_, step - 1};
  }

 private:
  std::optional<std::uint32_t> last_;
  std::uint64_t sequence_ = 0;
};

}  // namespace trigmesh
