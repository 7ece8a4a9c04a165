#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/base/file.hpp"
#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"
#include "firmware/session/journal_records.hpp"

namespace trigmesh {

/// Largest journal: about 600 000 frames. The writer stops there, so that it can always be read.
inline constexpr std::size_t kMaxJournalBytes = std::size_t{64} << 20U;

/// Bytes in the middle of a journal that are no records, or records that are missing there.
struct JournalDamage {
  std::uint64_t offset_bytes = 0;  ///< from the beginning of the file
  std::uint64_t size_bytes = 0;    ///< up to the next intact record
  std::string reason;
};

/// Everything that a journal still tells.
struct JournalScan {
  std::vector<JournalRecord> records;
  /// In order. Not empty: the device or a program changed what was already safe.
  std::vector<JournalDamage> damages;
  std::size_t unknown_records = 0;  ///< intact, written by a later program
  std::uint64_t valid_bytes = 0;    ///< where the last intact record ends
  /// What stands behind it: a record that was being written when the power went. Not a damage.
  std::uint64_t torn_bytes = 0;
  std::uint32_t next_sequence = 0;
};

/// Reads as much as there is. Whatever the bytes are, this is no failure: what does not check is in
/// `damages` (an intact record follows it) or in `torn_bytes` (none follows).
[[nodiscard]] JournalScan scan_journal(std::span<const std::uint8_t> bytes);

/// The same from a file. kNotFound, kIo, kLimitExceeded.
[[nodiscard]] Result<JournalScan> read_journal(FileSystem& files,
                                               const std::filesystem::path& path);

/// Whether a record is on the disk when append returns. Frames kept or undone, states and settings
/// are: somebody acts on them. Edges, refusals, keyframes, counts and notes wait for the next
/// record that is, or for sync(): they go with what they explain.
[[nodiscard]] bool must_be_durable(const JournalEntry& entry);

/// Appends records. Thread-compatible. `files` and the clocks outlive it.
class JournalWriter {
 public:
  struct Opened;

  /// Opens or makes the journal, cuts a torn tail off, and goes on behind the last intact record.
  /// Gives also what is in it. The caller fsyncs the folder of a new one. kIo, kNoSpace,
  /// kLimitExceeded.
  [[nodiscard]] static Result<Opened> open(FileSystem& files,
                                           const std::filesystem::path& path,
                                           const Clock& clock,
                                           const WallClock& wall_clock);

  /// After an error nothing of the record remains, and appending may be tried again (kNoSpace) -
  /// unless the journal `is_broken`. kNoSpace, kIo, kLimitExceeded.
  [[nodiscard]] Result<> append(JournalEntry entry);

  /// Puts all records on the disk.
  [[nodiscard]] Result<> sync();

  /// fsync failed, or a half-written record could not be taken back: the kernel may have dropped
  /// what it had, so nothing more is written. Opening the journal again finds out what is there.
  [[nodiscard]] bool is_broken() const { return broken_; }

  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }

 private:
  JournalWriter(File file, const JournalScan& scan, const Clock& clock, const WallClock& wall_clock)
      : file_(std::move(file)),
        clock_(&clock),
        wall_clock_(&wall_clock),
        size_bytes_(scan.valid_bytes),
        next_sequence_(scan.next_sequence) {}

  [[nodiscard]] tl::unexpected<Error> take_back(Error error);

  File file_;
  const Clock* clock_;
  const WallClock* wall_clock_;
  std::uint64_t size_bytes_;
  std::uint32_t next_sequence_;
  bool dirty_ = false;
  bool broken_ = false;
};

struct JournalWriter::Opened {
  JournalWriter writer;
  JournalScan scan;
};

}  // namespace trigmesh
