#include "firmware/session/journal_codec.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using ::testing::HasSubstr;

std::vector<JournalEntry> one_of_each_kind() {
  FrameMetadata metadata{nanoseconds(123), nanoseconds(10'000'000), 2.5, std::nullopt, 77};
  return {
      EdgeRecord{EdgeDirection::kRelease, nanoseconds(5)},
      FrameKept{3, 1000, 0xABCDEF, metadata},
      FrameRefused{FrameRefusal::kBlurred, 0, 78, 0.25},
      KeyframeChosen{3},
      StateChange{SessionState::kClosed, "long press"},
      SettingsUsed{"[capture]\nmode = 'still'\n", 42},
      DropCounts{1, 2, 3},
      Note{"hello"},
      FramesJudged{{{77, nanoseconds(5), FrameVerdict::kTooFast, {12.5, 0.5, 90.0, 3.0, 1.0, 0.25}},
                    {78, nanoseconds(6), FrameVerdict::kKept, {}}}},
      FrameMapped{4, MapFollowing::kLost, nanoseconds(30'000'000), 2}};
}

JournalRecord record_of(JournalEntry entry) {
  return {9, nanoseconds(1'000), nanoseconds(-2'000), std::move(entry)};
}

TEST(JournalCodec, GivesEveryKindBackAsItWas) {
  const auto entries = one_of_each_kind();
  ASSERT_EQ(entries.size(), std::variant_size_v<JournalEntry>);
  for (const JournalEntry& entry : entries) {
    const auto bytes = encode_record(record_of(entry));
    ASSERT_TRUE(bytes);
    const auto decoded = decode_record(*bytes);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->record, record_of(entry));
    EXPECT_EQ(decoded->size_bytes, bytes->size());
  }
}

TEST(JournalCodec, ChecksumIsTheOneOfTheStandard) {
  // RFC 3720, B.4: the check value of "123456789" and of 32 zeros.
  const std::string digits = "123456789";
  EXPECT_EQ(crc32c({reinterpret_cast<const std::uint8_t*>(digits.data()), digits.size()}),
            0xE3069283U);
  EXPECT_EQ(crc32c(std::vector<std::uint8_t>(32, 0)), 0x8A9136AAU);
}

TEST(JournalCodec, NoticesEveryFlippedBit) {
  for (const JournalEntry& entry : one_of_each_kind()) {
    auto bytes = encode_record(record_of(entry)).value();
    for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
      const auto mask = static_cast<std::uint8_t>(1U << (bit % 8));
      bytes[bit / 8] ^= mask;
      EXPECT_FALSE(decode_record(bytes)) << "bit " << bit;
      bytes[bit / 8] ^= mask;
    }
  }
}

TEST(JournalCodec, NoticesEveryCut) {
  const auto bytes = encode_record(record_of(Note{"a note"})).value();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decode_record(std::span(bytes).first(size)));
    EXPECT_EQ(intact_record_bytes(std::span(bytes).first(size)), 0U);
  }
  EXPECT_EQ(intact_record_bytes(bytes), bytes.size());
}

TEST(JournalCodec, RefusesTextsOverTheLimit) {
  EXPECT_TRUE(encode_record(record_of(Note{std::string(kMaxJournalTextBytes, 'x')})));
  const auto refused = encode_record(record_of(Note{std::string(kMaxJournalTextBytes + 1, 'x')}));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kLimitExceeded);
}

TEST(JournalCodec, SaysThatALaterProgramWroteAKind) {
  auto bytes = encode_record(record_of(Note{"x"})).value();
  bytes[9] = 200;
  const std::uint32_t checksum = crc32c(std::span(bytes).first(bytes.size() - 4));
  std::memcpy(bytes.data() + bytes.size() - 4, &checksum, sizeof(checksum));
  const auto decoded = decode_record(bytes);
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::kUnsupported);
  EXPECT_THAT(decoded.error().message, HasSubstr("kind 200"));
  EXPECT_EQ(intact_record_bytes(bytes), bytes.size());
}

TEST(JournalCodec, NamesEveryReasonAndState) {
  EXPECT_EQ(to_string(FrameRefusal::kNotStored), "not stored");
  EXPECT_EQ(to_string(SessionState::kModelFailed), "model_failed");
}

}  // namespace
}  // namespace trigmesh
