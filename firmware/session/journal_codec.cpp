#include "firmware/session/journal_codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include <boost/crc.hpp>

#include "firmware/base/binary_stream.hpp"
#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint8_t kVersion = 1;
constexpr std::size_t kMaxPayloadBytes = kMaxJournalTextBytes + 64;

struct Header {
  std::array<char, 4> magic{};
  std::uint32_t payload_bytes = 0;
  std::uint8_t version = kVersion;
  std::uint8_t kind = 0;
  std::uint16_t zero = 0;
  std::uint32_t sequence = 0;
  std::int64_t monotonic_ns = 0;
  std::int64_t wall_ns = 0;
};

static_assert(sizeof(Header) == kJournalHeaderBytes);

template <typename T>
void put_optional(BinaryWriter& out, const std::optional<T>& value) {
  out.value(static_cast<std::uint8_t>(value ? 1 : 0));
  out.value(value.value_or(T{}));
}

struct PayloadWriter {
  BinaryWriter& out;

  void operator()(const EdgeRecord& entry) const {
    out.value(entry.direction);
    out.value(static_cast<std::int64_t>(entry.kernel_time.count()));
  }

  void operator()(const FrameKept& entry) const {
    out.value(entry.number);
    out.value(entry.size_bytes);
    out.value(entry.content_hash);
    const FrameMetadata& metadata = entry.metadata;
    out.value(static_cast<std::int64_t>(metadata.timestamp.count()));
    out.value(metadata.sensor_sequence);
    put_optional(out,
                 metadata.exposure.has_value()
                     ? std::optional(static_cast<std::int64_t>(metadata.exposure->count()))
                     : std::nullopt);
    put_optional(out, metadata.gain);
    put_optional(out, metadata.lens_dioptres);
  }

  void operator()(const FrameRefused& entry) const {
    out.value(entry.reason);
    out.value(entry.number);
    out.value(entry.sensor_sequence);
    out.value(entry.value);
  }

  void operator()(const KeyframeChosen& entry) const { out.value(entry.number); }

  void operator()(const StateChange& entry) const {
    out.value(entry.state);
    out.text(entry.why);
  }

  void operator()(const SettingsUsed& entry) const {
    out.value(entry.seed);
    out.text(entry.toml);
  }

  void operator()(const DropCounts& entry) const {
    out.value(entry.sensor);
    out.value(entry.queue);
    out.value(entry.corrupt);
  }

  void operator()(const Note& entry) const { out.text(entry.text); }

  void operator()(const FramesJudged& entry) const {
    out.value(static_cast<std::uint32_t>(entry.frames.size()));
    for (const FrameJudged& frame : entry.frames) {
      out.value(frame.sensor_sequence);
      out.value(static_cast<std::int64_t>(frame.timestamp.count()));
      out.value(frame.verdict);
      const FrameMeasures& measures = frame.measures;
      for (const double value : {measures.sharpness,
                                 measures.relative_sharpness,
                                 measures.brightness,
                                 measures.motion_deg,
                                 measures.parallax_deg,
                                 measures.overlap}) {
        out.value(value);
      }
    }
  }

  void operator()(const FrameMapped& entry) const {
    out.value(entry.number);
    out.value(entry.following);
    out.value(static_cast<std::int64_t>(entry.duration.count()));
    out.value(entry.waiting);
  }
};

/// BinaryReader with the checks that values need; `valid` is false after a value that cannot be.
class PayloadReader {
 public:
  explicit PayloadReader(std::span<const std::uint8_t> bytes) : in_(bytes) {}

  template <typename T>
  [[nodiscard]] T value() {
    return in_.value<T>();
  }

  template <typename Enum>
  [[nodiscard]] Enum choice(Enum last) {
    const auto number = in_.value<std::uint8_t>();
    valid_ = valid_ && number <= static_cast<std::uint8_t>(last);
    return valid_ ? static_cast<Enum>(number) : Enum{};
  }

  [[nodiscard]] double finite() {
    const auto number = in_.value<double>();
    valid_ = valid_ && std::isfinite(number);
    return number;
  }

  [[nodiscard]] nanoseconds time() {
    const auto count = in_.value<std::int64_t>();
    valid_ = valid_ && count >= 0;
    return nanoseconds(count);
  }

  /// `read` reads the value, which is stored (as zero) also when there is none.
  template <typename Read>
  [[nodiscard]] auto optional(Read read) -> std::optional<decltype(read())> {
    const auto present = in_.value<std::uint8_t>();
    valid_ = valid_ && present <= 1;
    const auto stored = read();
    return present == 1 ? std::optional(stored) : std::nullopt;
  }

  [[nodiscard]] std::string text() {
    std::string characters = in_.text();
    valid_ = valid_ && characters.size() <= kMaxJournalTextBytes;
    return characters;
  }

  [[nodiscard]] bool is_valid() const { return valid_ && in_.ok(); }

  [[nodiscard]] bool complete() const { return valid_ && in_.complete(); }

 private:
  BinaryReader in_;
  bool valid_ = true;
};

void read(PayloadReader& in, EdgeRecord& entry) {
  entry.direction = in.choice(EdgeDirection::kRelease);
  entry.kernel_time = in.time();
}

void read(PayloadReader& in, FrameKept& entry) {
  entry.number = in.value<std::uint32_t>();
  entry.size_bytes = in.value<std::uint64_t>();
  entry.content_hash = in.value<std::uint64_t>();
  entry.metadata.timestamp = in.time();
  entry.metadata.sensor_sequence = in.value<std::uint64_t>();
  entry.metadata.exposure = in.optional([&] { return in.time(); });
  entry.metadata.gain = in.optional([&] { return in.finite(); });
  entry.metadata.lens_dioptres = in.optional([&] { return in.finite(); });
}

void read(PayloadReader& in, FrameRefused& entry) {
  entry.reason = in.choice(FrameRefusal::kNotStored);
  entry.number = in.value<std::uint32_t>();
  entry.sensor_sequence = in.value<std::uint64_t>();
  entry.value = in.finite();
}

void read(PayloadReader& in, KeyframeChosen& entry) {
  entry.number = in.value<std::uint32_t>();
}

void read(PayloadReader& in, StateChange& entry) {
  entry.state = in.choice(SessionState::kModelFailed);
  entry.why = in.text();
}

void read(PayloadReader& in, SettingsUsed& entry) {
  entry.seed = in.value<std::uint64_t>();
  entry.toml = in.text();
}

void read(PayloadReader& in, DropCounts& entry) {
  entry.sensor = in.value<std::uint64_t>();
  entry.queue = in.value<std::uint64_t>();
  entry.corrupt = in.value<std::uint64_t>();
}

void read(PayloadReader& in, Note& entry) {
  entry.text = in.text();
}

void read(PayloadReader& in, FramesJudged& entry) {
  const auto count = in.value<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && i < kMaxJudgedFrames && in.is_valid(); ++i) {
    FrameJudged& frame = entry.frames.emplace_back();
    frame.sensor_sequence = in.value<std::uint64_t>();
    frame.timestamp = in.time();
    frame.verdict = in.choice(FrameVerdict::kOverBudget);
    FrameMeasures& measures = frame.measures;
    for (double* value : {&measures.sharpness,
                          &measures.relative_sharpness,
                          &measures.brightness,
                          &measures.motion_deg,
                          &measures.parallax_deg,
                          &measures.overlap}) {
      *value = in.finite();
    }
  }
}

void read(PayloadReader& in, FrameMapped& entry) {
  entry.number = in.value<std::uint32_t>();
  entry.following = in.choice(MapFollowing::kLost);
  entry.duration = in.time();
  entry.waiting = in.value<std::uint32_t>();
}

/// Tries the kinds one after the other until the one with this number.
template <std::size_t kKind = 0>
std::optional<JournalEntry> read_entry(std::size_t kind, PayloadReader& in) {
  if constexpr (kKind == std::variant_size_v<JournalEntry>) {
    return std::nullopt;
  } else {
    if (kind != kKind) {
      return read_entry<kKind + 1>(kind, in);
    }
    std::variant_alternative_t<kKind, JournalEntry> entry;
    read(in, entry);
    return entry;
  }
}

Header header_of(std::span<const std::uint8_t> bytes) {
  TM_CHECK(bytes.size() >= kJournalHeaderBytes);
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  return header;
}

/// Why there is no intact record at the beginning of `bytes`; empty: there is one.
std::string_view why_not_intact(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kJournalHeaderBytes + kJournalTrailerBytes) {
    return "the record is cut off";
  }
  const Header header = header_of(bytes);
  if (std::string_view(header.magic.data(), header.magic.size()) != kJournalMagic) {
    return "no record begins here";
  }
  if (header.payload_bytes > kMaxPayloadBytes) {
    return "the length is impossible";
  }
  const std::size_t covered = kJournalHeaderBytes + header.payload_bytes;
  if (bytes.size() < covered + kJournalTrailerBytes) {
    return "the record is cut off";
  }
  std::uint32_t stored = 0;
  std::memcpy(&stored, bytes.data() + covered, sizeof(stored));
  return crc32c(bytes.first(covered)) == stored ? "" : "the checksum does not hold";
}

std::size_t longest_text(const JournalEntry& entry) {
  if (const auto* change = std::get_if<StateChange>(&entry)) {
    return change->why.size();
  }
  if (const auto* settings = std::get_if<SettingsUsed>(&entry)) {
    return settings->toml.size();
  }
  const auto* note = std::get_if<Note>(&entry);
  return note == nullptr ? 0 : note->text.size();
}

}  // namespace

std::string_view to_string(MapFollowing following) {
  constexpr std::array<std::string_view, 3> kNames = {"waiting", "tracked", "lost"};
  return kNames[static_cast<std::size_t>(following)];
}

std::string_view to_string(FrameRefusal reason) {
  constexpr std::array<std::string_view, 9> kNames = {"undone",
                                                      "blurred",
                                                      "too little motion",
                                                      "too fast",
                                                      "exposure jump",
                                                      "duplicate",
                                                      "corrupt",
                                                      "no space",
                                                      "not stored"};
  return kNames.at(static_cast<std::size_t>(reason));
}

std::string_view to_string(SessionState state) {
  constexpr std::array<std::string_view, 6> kNames = {
      "capturing", "interrupted", "closed", "reconstructing", "model_ready", "model_failed"};
  return kNames.at(static_cast<std::size_t>(state));
}

std::uint32_t crc32c(std::span<const std::uint8_t> bytes) {
  constexpr std::uint32_t kCastagnoli = 0x1EDC6F41;
  constexpr std::uint32_t kOnes = 0xFFFFFFFF;
  boost::crc_optimal<32, kCastagnoli, kOnes, kOnes, true, true> crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

Result<std::vector<std::uint8_t>> encode_record(const JournalRecord& record) {
  if (longest_text(record.entry) > kMaxJournalTextBytes) {
    return fail(ErrorCode::kLimitExceeded,
                "cannot write a text of {} bytes into the journal: the limit is {}",
                longest_text(record.entry),
                kMaxJournalTextBytes);
  }
  if (const auto* judged = std::get_if<FramesJudged>(&record.entry);
      judged != nullptr && judged->frames.size() > kMaxJudgedFrames) {
    return fail(
        ErrorCode::kLimitExceeded,
        "cannot write the verdicts on {} frames into one record of the journal: the limit is "
        "{}",
        judged->frames.size(),
        kMaxJudgedFrames);
  }
  BinaryWriter payload_writer;
  std::visit(PayloadWriter{payload_writer}, record.entry);
  const std::vector<std::uint8_t> payload = payload_writer.take();
  Header header;
  std::copy(kJournalMagic.begin(), kJournalMagic.end(), header.magic.begin());
  header.payload_bytes = static_cast<std::uint32_t>(payload.size());
  header.kind = static_cast<std::uint8_t>(record.entry.index());
  header.sequence = record.sequence;
  header.monotonic_ns = record.monotonic.count();
  header.wall_ns = record.wall.count();
  std::vector<std::uint8_t> bytes(kJournalHeaderBytes + payload.size() + kJournalTrailerBytes);
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::copy(payload.begin(), payload.end(), bytes.begin() + kJournalHeaderBytes);
  const std::size_t covered = kJournalHeaderBytes + payload.size();
  const std::uint32_t checksum = crc32c(std::span(bytes).first(covered));
  std::memcpy(bytes.data() + covered, &checksum, sizeof(checksum));
  return bytes;
}

Result<DecodedRecord> decode_record(std::span<const std::uint8_t> bytes) {
  if (const std::string_view why = why_not_intact(bytes); !why.empty()) {
    return fail(ErrorCode::kCorruptData, "{}", why);
  }
  const Header header = header_of(bytes);
  if (header.version != kVersion || header.kind >= std::variant_size_v<JournalEntry>) {
    return fail(ErrorCode::kUnsupported,
                "record {} has version {} and kind {}, which this program does not know",
                header.sequence,
                header.version,
                header.kind);
  }
  PayloadReader in(bytes.subspan(kJournalHeaderBytes, header.payload_bytes));
  std::optional<JournalEntry> entry = read_entry(header.kind, in);
  if (!entry || !in.complete() || header.zero != 0) {
    return fail(ErrorCode::kCorruptData, "the content of record {} is not valid", header.sequence);
  }
  return DecodedRecord{kJournalHeaderBytes + header.payload_bytes + kJournalTrailerBytes,
                       {header.sequence,
                        nanoseconds(header.monotonic_ns),
                        nanoseconds(header.wall_ns),
                        *std::move(entry)}};
}

std::size_t intact_record_bytes(std::span<const std::uint8_t> bytes) {
  return why_not_intact(bytes).empty()
             ? kJournalHeaderBytes + header_of(bytes).payload_bytes + kJournalTrailerBytes
             : 0;
}

std::uint32_t sequence_of_intact(std::span<const std::uint8_t> bytes) {
  return header_of(bytes).sequence;
}

}  // namespace trigmesh
