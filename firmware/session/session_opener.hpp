#pragma once

#include <map>
#include <vector>

#include "firmware/session/session.hpp"

namespace trigmesh {

/// The steps of Session::open, one after the other. Every step may be cut off: the next opening
/// does it again.
class SessionOpener {
 public:
  SessionOpener(const SessionContext& context, std::filesystem::path folder)
      : context_(context), folder_(std::move(folder)) {}

  [[nodiscard]] Result<Session::Opened> open();

 private:
  void replay_journal(const std::vector<JournalRecord>& records);
  [[nodiscard]] Result<> remove_leftovers();
  [[nodiscard]] Result<> match_frame_files();
  [[nodiscard]] Result<> settle_state(Session& session);

  SessionContext context_;
  std::filesystem::path folder_;
  std::map<std::uint32_t, FrameKept> kept_;  ///< by number
  std::uint32_t last_number_ = 0;
  SessionState state_ = SessionState::kCapturing;
  SessionRecovery recovery_;
};

}  // namespace trigmesh
