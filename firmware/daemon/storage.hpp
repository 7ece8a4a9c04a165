#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "firmware/daemon/capture_types.hpp"
#include "firmware/daemon/frame_store.hpp"
#include "firmware/daemon/heartbeat.hpp"
#include "firmware/daemon/logging.hpp"
#include "firmware/daemon/model_maker.hpp"
#include "firmware/daemon/rig_inputs.hpp"
#include "firmware/daemon/storage_inbox.hpp"

namespace trigmesh {

struct StorageOptions {
  FrameStoreOptions store;
  /// How often the free space is looked at, and a disk that failed is tried again. > 0.
  std::chrono::nanoseconds check_interval = std::chrono::seconds(2);
  /// Whether the maker of models hears of frames while they are captured.
  bool tells_captures = false;
};

/// What the storage thread works with; all of it outlives it.
struct StorageParts {
  StorageInbox& inbox;
  RigQueue& rig;
  ModelMaker& models;
  const FrameDrops& drops;
  Faults& faults;
  Heartbeat& heartbeat;
  const Clock& clock;
};

/// The only thread that touches the sessions on disk: does the orders of the inbox one after the
/// other and answers the rig. Whatever it was given is stored or refused with a reason: persistence
/// never drops. A disk that cannot be written is told, and tried again. Single thread: run() is the
/// thread.
class Storage {
 public:
  Storage(StorageOptions options, const StorePlace& place, const StorageParts& parts)
      : options_(std::move(options)), parts_(parts), store_(options_.store, place) {}

  /// Until the inbox is closed and everything in it was done.
  void run();

 private:
  void look_after_disk();
  void open_store();
  void tell_found(const FrameStore::Found& found);
  void report(StorageLevel level, std::uint64_t available_bytes);
  void check_level();
  /// Reading or writing failed: the session ends here, and the disk is tried again later.
  void disk_failed(const Error& error);

  void do_order(const OpenSessionOrder& order);
  [[nodiscard]] Result<std::string> open_session(const OpenSessionOrder& order);
  void do_order(RecordOrder order);
  void do_order(StreamFrameOrder order);
  void do_order(StillFrameOrder order);
  void do_order(StreamDoneOrder order);
  void do_order(UndoOrder order);
  void do_order(const CloseOrder& order);
  void do_order(BeginModelOrder order);
  void do_order(StopModelOrder order);
  void do_order(ModelEndedOrder order);
  void do_order(const ListOrder& order);
  void do_order(RemoveOrder order);
  void do_order(BeginExportOrder order);
  void do_order(const EndExportOrder& order);

  [[nodiscard]] Result<std::uint32_t> store_frame(const TimedFrame& timed);
  void refuse(const TimedFrame& timed, const Error& error);
  void tell_capture(CaptureNews news);
  void tell_capture_began();
  void tell_capture_ended();

  [[nodiscard]] bool is_current(SessionSerial serial) const {
    return store_.has_session() && serial == serial_;
  }

  /// Why a session cannot be removed or exported now.
  [[nodiscard]] Result<> check_unused(const std::string& id);
  [[nodiscard]] DropCounts drops_of_session() const;

  StorageOptions options_;
  StorageParts parts_;
  FrameStore store_;
  SessionSerial serial_{};  ///< of the open session
  DropCounts drops_at_begin_;
  bool is_capture_told_ = false;  ///< it began, and did not end
  std::string model_id_;          ///< at work; empty: none
  std::string export_id_;         ///< on its way; empty: none
  std::optional<StorageReport> told_;
  std::optional<std::chrono::nanoseconds> last_check_;
};

}  // namespace trigmesh
