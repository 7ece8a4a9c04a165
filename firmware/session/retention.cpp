#include "firmware/session/retention.hpp"

namespace trigmesh {

bool may_be_removed(const SessionInfo& session, const RetentionRules& rules) {
  const SessionState state = session.manifest.state;
  const bool finished = state == SessionState::kClosed || state == SessionState::kModelReady ||
                        state == SessionState::kModelFailed;
  return rules.removal == RetentionRules::Removal::kWhenNeeded && finished &&
         (session.has_model || rules.without_model) &&
         (session.manifest.exported || rules.not_exported);
}

std::vector<std::string> choose_victims(std::span<const SessionInfo> sessions,
                                        const RetentionRules& rules,
                                        std::uint64_t needed_bytes) {
  std::vector<std::string> victims;
  std::uint64_t gained_bytes = 0;
  for (const SessionInfo& session : sessions) {
    if (gained_bytes >= needed_bytes) {
      break;
    }
    if (may_be_removed(session, rules)) {
      victims.push_back(session.manifest.id);
      gained_bytes += session.size_bytes;
    }
  }
  return victims;
}

}  // namespace trigmesh
