#include "firmware/daemon/retries.hpp"

#include <algorithm>

namespace trigmesh {

std::chrono::milliseconds Retries::delay_after(FaultKind kind) {
  constexpr int kMostDoublings = 16;
  const FaultPolicy policy = fault_policy(kind);
  const int doublings = std::min(tries_, kMostDoublings);
  tries_ = std::min(tries_ + 1, 1'000'000);
  if (policy.action == FaultAction::kGiveUp ||
      (policy.max_tries > 0 && tries_ > policy.max_tries)) {
    return kAfterGivingUp;
  }
  return std::min(policy.first_delay * (1 << doublings), policy.longest_delay);
}

}  // namespace trigmesh
