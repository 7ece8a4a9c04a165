#include "firmware/session/journal.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/session/journal_codec.hpp"

namespace trigmesh {
namespace {

std::string_view as_text(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Offset of the first intact record at or after `from`; the end when there is none.
std::size_t next_intact(std::span<const std::uint8_t> bytes, std::size_t from) {
  const std::string_view text = as_text(bytes);
  for (std::size_t at = text.find(kJournalMagic, from); at != std::string_view::npos;
       at = text.find(kJournalMagic, at + 1)) {
    if (intact_record_bytes(bytes.subspan(at)) > 0) {
      return at;
    }
  }
  return bytes.size();
}

/// Takes the intact record at `offset` into the scan.
void take_record(std::span<const std::uint8_t> bytes, std::size_t offset, JournalScan& scan) {
  const std::span<const std::uint8_t> rest = bytes.subspan(offset);
  const std::size_t size = intact_record_bytes(rest);
  const std::uint32_t sequence = sequence_of_intact(rest);
  if (sequence != scan.next_sequence) {
    scan.damages.push_back(
        {offset,
         0,
         fmt::format("record {} stands where {} was expected", sequence, scan.next_sequence)});
  }
  Result<DecodedRecord> decoded = decode_record(rest);
  if (decoded) {
    scan.records.push_back(std::move(decoded->record));
  } else if (decoded.error().code == ErrorCode::kUnsupported) {
    ++scan.unknown_records;
  } else {
    scan.damages.push_back({offset, size, decoded.error().message});
  }
  scan.next_sequence = sequence + 1;
  scan.valid_bytes = offset + size;
}

}  // namespace

JournalScan scan_journal(std::span<const std::uint8_t> bytes) {
  JournalScan scan;
  std::size_t offset = 0;
  while (offset < bytes.size()) {
    if (intact_record_bytes(bytes.subspan(offset)) == 0) {
      const std::size_t next = next_intact(bytes, offset + 1);
      if (next == bytes.size()) {
        break;
      }
      const Result<DecodedRecord> decoded = decode_record(bytes.subspan(offset));
      scan.damages.push_back({offset, next - offset, decoded.error().message});
      offset = next;
    }
    take_record(bytes, offset, scan);
    offset = static_cast<std::size_t>(scan.valid_bytes);
  }
  scan.torn_bytes = bytes.size() - scan.valid_bytes;
  return scan;
}

Result<JournalScan> read_journal(FileSystem& files, const std::filesystem::path& path) {
  TM_ASSIGN_OR_RETURN(const std::string text, read_file(files, path, kMaxJournalBytes));
  return scan_journal({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

bool must_be_durable(const JournalEntry& entry) {
  if (const auto* refused = std::get_if<FrameRefused>(&entry)) {
    return refused->reason == FrameRefusal::kUndone;
  }
  return std::holds_alternative<FrameKept>(entry) || std::holds_alternative<StateChange>(entry) ||
         std::holds_alternative<SettingsUsed>(entry);
}

Result<JournalWriter::Opened> JournalWriter::open(FileSystem& files,
                                                  const std::filesystem::path& path,
                                                  const Clock& clock,
                                                  const WallClock& wall_clock) {
  JournalScan scan;
  Result<JournalScan> found = read_journal(files, path);
  if (found) {
    scan = std::move(*found);
  } else if (found.error().code != ErrorCode::kNotFound) {
    return tl::unexpected<Error>(std::move(found).error());
  }
  TM_ASSIGN_OR_RETURN(File file, File::open(files, path, OpenMode::kAppend));
  if (scan.torn_bytes > 0) {
    TM_RETURN_IF_ERROR(file.truncate(scan.valid_bytes));
  }
  // What was found may be in the kernel's memory only: from here on it is acted upon.
  TM_RETURN_IF_ERROR(file.sync());
  JournalWriter writer(std::move(file), scan, clock, wall_clock);
  return Opened{std::move(writer), std::move(scan)};
}

Result<> JournalWriter::append(JournalEntry entry) {
  if (broken_) {
    return fail(ErrorCode::kIo,
                "cannot write to the journal {}: an earlier write failed; open the session again",
                file_.path().string());
  }
  const bool durable = must_be_durable(entry);
  TM_ASSIGN_OR_RETURN(
      const std::vector<std::uint8_t> bytes,
      encode_record({next_sequence_, clock_->now(), wall_clock_->now(), std::move(entry)}));
  if (size_bytes_ + bytes.size() > kMaxJournalBytes) {
    return fail(ErrorCode::kLimitExceeded,
                "the journal {} is full ({} bytes); close the session and begin another one",
                file_.path().string(),
                kMaxJournalBytes);
  }
  if (Result<> written = file_.write(as_text(bytes)); !written) {
    return take_back(std::move(written).error());
  }
  dirty_ = true;
  if (durable) {
    if (Result<> synced = sync(); !synced) {
      (void)file_.truncate(size_bytes_);  // best effort: it was not acknowledged
      return synced;
    }
  }
  size_bytes_ += bytes.size();
  ++next_sequence_;
  return {};
}

Result<> JournalWriter::sync() {
  if (!dirty_) {
    return {};
  }
  Result<> synced = file_.sync();
  broken_ = !synced;
  dirty_ = broken_;
  return synced;
}

tl::unexpected<Error> JournalWriter::take_back(Error error) {
  if (!file_.truncate(size_bytes_)) {
    broken_ = true;
  }
  return tl::unexpected<Error>(std::move(error));
}

}  // namespace trigmesh
