#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/session/journal_records.hpp"

namespace trigmesh {

// One record on disk, little endian:
//
//     offset  bytes
//     0       4      "TMJR"
//     4       4      length n of the payload
//     8       1      version of the format, 1
//     9       1      kind: place in JournalEntry
//     10      2      0
//     12      4      sequence
//     16      8      monotonic time, ns
//     24      8      wall time, ns
//     32      n      payload
//     32 + n  4      CRC32C of all bytes before it
inline constexpr std::string_view kJournalMagic = "TMJR";
inline constexpr std::size_t kJournalHeaderBytes = 32;
inline constexpr std::size_t kJournalTrailerBytes = 4;

/// CRC32C (Castagnoli), of the library Boost.CRC.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::uint8_t> bytes);

/// kLimitExceeded for a text longer than kMaxJournalTextBytes.
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_record(const JournalRecord& record);

/// What stands at the beginning of some bytes.
struct DecodedRecord {
  std::size_t size_bytes = 0;  ///< of the record with header and trailer
  JournalRecord record;
};

/// Reads the record at the beginning of `bytes`; what follows it is not looked at. kCorruptData:
/// too short, no magic, checksum or payload wrong (says which). kUnsupported: whole, but of a kind
/// or version that a later program wrote; `intact_record_bytes` tells its size.
[[nodiscard]] Result<DecodedRecord> decode_record(std::span<const std::uint8_t> bytes);

/// Size of the record at the beginning of `bytes` when its length and checksum hold, else 0.
[[nodiscard]] std::size_t intact_record_bytes(std::span<const std::uint8_t> bytes);

/// The `sequence` of a record whose size intact_record_bytes gave.
[[nodiscard]] std::uint32_t sequence_of_intact(std::span<const std::uint8_t> bytes);

}  // namespace trigmesh
