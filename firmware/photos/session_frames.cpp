#include "firmware/photos/session_frames.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <set>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_system.hpp"
#include "firmware/session/journal.hpp"
#include "firmware/session/layout.hpp"

namespace trigmesh {

namespace {

/// What the records of a capture say, by frame.
struct CaptureRecords {
  std::map<std::uint64_t, FrameJudged> judged;       ///< by the sensor's sequence
  std::map<std::uint64_t, std::uint32_t> number_of;  ///< kept ones
  std::map<std::uint32_t, FrameMapped> mapped;       ///< by number
  std::set<std::uint64_t> undone;                    ///< sequences

  void operator()(const FramesJudged& entry) {
    for (const FrameJudged& frame : entry.frames) {
      judged.insert_or_assign(frame.sensor_sequence, frame);
    }
  }

  void operator()(const FrameKept& entry) {
    number_of.insert_or_assign(entry.metadata.sensor_sequence, entry.number);
  }

  void operator()(const FrameRefused& entry) {
    if (entry.reason == FrameRefusal::kUndone) {
      undone.insert(entry.sensor_sequence);
      mapped.erase(entry.number);
    }
  }

  void operator()(const FrameMapped& entry) { mapped.insert_or_assign(entry.number, entry); }

  template <typename Other>
  void operator()(const Other& /*entry*/) {}
};

VideoFrameSection section_of(const FrameJudged& frame, const CaptureRecords& records) {
  VideoFrameSection section;
  section.verdict = frame.verdict;
  section.measures = frame.measures;
  const auto number = records.number_of.find(frame.sensor_sequence);
  if (number == records.number_of.end()) {
    section.name = fmt::format("frame {}", frame.sensor_sequence);
    return section;
  }
  section.name = frame_file_name(number->second);
  if (const auto mapped = records.mapped.find(number->second); mapped != records.mapped.end()) {
    const std::chrono::duration<double> duration = mapped->second.duration;
    section.live = LiveMapping{
        std::string(to_string(mapped->second.following)), duration.count(), mapped->second.waiting};
  }
  return section;
}

}  // namespace

Result<std::vector<VideoFrameSection>> read_session_frames(const std::filesystem::path& session) {
  TM_ASSIGN_OR_RETURN(const JournalScan scan,
                      read_journal(real_file_system(), session / kJournalName));
  CaptureRecords records;
  for (const JournalRecord& record : scan.records) {
    std::visit(records, record.entry);
  }
  std::vector<const FrameJudged*> frames;
  for (const auto& [sequence, frame] : records.judged) {
    if (!records.undone.contains(sequence)) {
      frames.push_back(&frame);
    }
  }
  std::stable_sort(frames.begin(), frames.end(), [](const FrameJudged* a, const FrameJudged* b) {
    return a->timestamp < b->timestamp;
  });
  std::vector<VideoFrameSection> sections;
  for (const FrameJudged* frame : frames) {
    const std::chrono::duration<double> time = frame->timestamp - frames.front()->timestamp;
    sections.push_back(section_of(*frame, records));
    sections.back().time_s = time.count();
  }
  return sections;
}

}  // namespace trigmesh
