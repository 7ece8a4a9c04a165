#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "firmware/base/check.hpp"
#include "firmware/session/journal.hpp"
#include "firmware/session/journal_codec.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

/// The fuzzer does not guess checksums: every place that looks like a record gets the right one.
std::vector<std::uint8_t> with_checksums(std::vector<std::uint8_t> bytes) {
  constexpr std::size_t kLengthAt = 4;
  for (std::size_t at = 0; at + trigmesh::kJournalHeaderBytes < bytes.size();) {
    const std::size_t covered = trigmesh::kJournalHeaderBytes + bytes[at + kLengthAt];
    if (at + covered + trigmesh::kJournalTrailerBytes > bytes.size()) {
      break;
    }
    const std::uint32_t checksum = trigmesh::crc32c(std::span(bytes).subspan(at, covered));
    for (std::size_t i = 0; i < sizeof(checksum); ++i) {
      bytes[at + covered + i] = static_cast<std::uint8_t>(checksum >> (8 * i));
    }
    at += covered + trigmesh::kJournalTrailerBytes;
  }
  return bytes;
}

/// Everything is accounted for, and every record that is accepted is written as it was read.
void check(std::span<const std::uint8_t> bytes) {
  const trigmesh::JournalScan scan = trigmesh::scan_journal(bytes);
  TM_CHECK(scan.valid_bytes + scan.torn_bytes == bytes.size());
  std::size_t accounted = 0;
  for (const trigmesh::JournalDamage& damage : scan.damages) {
    TM_CHECK(damage.offset_bytes + damage.size_bytes <= scan.valid_bytes);
    accounted += static_cast<std::size_t>(damage.size_bytes);
  }
  for (const trigmesh::JournalRecord& record : scan.records) {
    const auto again = trigmesh::encode_record(record);
    TM_CHECK(again.has_value());
    const auto decoded = trigmesh::decode_record(*again);
    TM_CHECK(decoded.has_value() && decoded->record == record);
    accounted += again->size();
  }
  TM_CHECK(scan.unknown_records > 0 || accounted == scan.valid_bytes);
}

}  // namespace

/// The first byte chooses whether checksums are made to hold.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  const std::vector<std::uint8_t> bytes(data + 1, data + size);
  check(data[0] % 2 == 0 ? bytes : with_checksums(bytes));
  return 0;
}
