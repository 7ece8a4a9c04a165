#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"
#include "firmware/session/retention.hpp"
#include "firmware/session/session.hpp"
#include "firmware/session/space_budget.hpp"

namespace trigmesh {

struct StoreOptions {
  std::filesystem::path root;  ///< holds one folder a session; made if it is missing
  SpaceLimits limits;
  RetentionRules retention;
  std::string software_version;
};

/// What a new session is captured with.
struct NewSession {
  std::string mode;            ///< "still", "video"
  std::string camera_profile;  ///< as TOML; empty: none
  std::string settings;        ///< as TOML
  std::uint64_t seed = 0;      ///< of everything random in its reconstruction
  std::uint64_t entropy = 0;   ///< for the end of its id: something that differs between boards
};

/// What opening the store found.
struct StoreRecovery {
  struct Recovered {
    std::string id;
    SessionRecovery details;
  };

  struct Unreadable {
    std::string name;  ///< of the folder, which is left alone
    Error error;
  };

  std::vector<Recovered> recovered;  ///< sessions that were not closed in order
  std::vector<Unreadable> unreadable;
};

/// All sessions of a rig, a folder each. A session appears whole and goes whole. Thread-compatible;
/// the sessions that it gives out may be used in other threads. The store outlives them; `files`
/// and the clocks outlive the store.
class SessionStore {
 public:
  /// Removes sessions that were half made or half removed, and recovers those that were open (see
  /// Session::open). kIo, kNoSpace.
  [[nodiscard]] static Result<SessionStore> open(FileSystem& files,
                                                 const Clock& clock,
                                                 const WallClock& wall_clock,
                                                 const StoreOptions& options);

  [[nodiscard]] const StoreRecovery& recovery() const { return recovery_; }

  /// Begins a session. Removes old ones first if the rules allow it and no space is left. kNoSpace,
  /// kIo.
  [[nodiscard]] Result<Session> create(const NewSession& what);

  /// One that exists. kInvalidArgument (no id), kNotFound, kCorruptData, kIo.
  [[nodiscard]] Result<Session::Opened> open_session(const std::string& id);

  /// Sorted by id, which is by age. Folders that are no session are left out. kIo.
  [[nodiscard]] Result<std::vector<SessionInfo>> list();

  /// Removes a session that nobody has open, whatever the rules say. kInvalidArgument, kNotFound,
  /// kIo.
  [[nodiscard]] Result<> remove(const std::string& id);

  /// Removes old sessions as the rules allow until `bytes` may be captured: the ids of those that
  /// went. No failure when that is not enough: admit() of the budget tells. kIo.
  [[nodiscard]] Result<std::vector<std::string>> make_room(std::uint64_t bytes);

  [[nodiscard]] const SpaceBudget& budget() const { return *budget_; }

  [[nodiscard]] std::filesystem::path folder_of(const std::string& id) const {
    return options_.root / id;
  }

 private:
  SessionStore(FileSystem& files,
               const Clock& clock,
               const WallClock& wall_clock,
               const StoreOptions& options);

  [[nodiscard]] SessionContext context() const {
    return {files_, clock_, wall_clock_, budget_.get()};
  }

  [[nodiscard]] Result<> recover();
  [[nodiscard]] Result<> recover_session(const std::string& id);
  [[nodiscard]] Result<> measure();
  [[nodiscard]] Result<std::string> stage_new(const NewSession& what);
  [[nodiscard]] Result<Session> put_in_place(const std::string& id);

  FileSystem* files_;
  const Clock* clock_;
  const WallClock* wall_clock_;
  StoreOptions options_;
  std::unique_ptr<SpaceBudget> budget_;  ///< on the heap: sessions keep a reference
  StoreRecovery recovery_;
};

}  // namespace trigmesh
