// Reads all sessions of a store as they lie on the disk, changes nothing, and says what is wrong.

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <xxhash.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "firmware/base/file_bytes.hpp"
#include "firmware/session/journal.hpp"
#include "firmware/session/layout.hpp"
#include "firmware/session/manifest.hpp"

namespace {

namespace fs = std::filesystem;
using namespace trigmesh;

constexpr std::size_t kMostFileBytes = 256'000'000;

/// What one journal says.
struct Story {
  std::map<std::uint32_t, FrameKept> frames;  ///< kept and not discarded
  std::set<std::uint32_t> undone;
  std::vector<std::chrono::nanoseconds> presses;  ///< kernel's times, ascending
  std::size_t releases = 0;
  std::map<std::uint32_t, std::chrono::nanoseconds>
      journaled;  ///< when a frame's record was written
  std::map<std::string, std::size_t> refusals;
  std::string states;  ///< in their order, joined by commas
};

class Checker {
 public:
  Checker(bool is_settled, bool takes_stills)
      : is_settled_(is_settled), takes_stills_(takes_stills) {}

  void check_session(const fs::path& folder) {
    const std::string id = folder.filename().string();
    RealFileSystem files;
    const auto manifest = read_manifest(files, folder);
    const auto scan = read_journal(files, folder / kJournalName);
    if (!manifest || !scan) {
      complain(id, manifest ? scan.error().message : manifest.error().message);
      return;
    }
    for (const JournalDamage& damage : scan->damages) {
      complain(id, "its journal is damaged: " + damage.reason);
    }
    if (is_settled_ && scan->torn_bytes > 0) {
      complain(id, "the torn tail of its journal was not cut");
    }
    const Story story = story_of(*scan);
    check_frames(folder, story);
    const std::string model = check_model(folder);
    if (is_settled_) {
      check_settled(folder, *manifest, story);
    }
    if (takes_stills_) {
      check_stills(id, story);
    }
    frame_counts_[id] = story.frames.size();
    undone_counts_[id] = story.undone.size();
    std::cout << fmt::format(
        "session {} state={} frames={} undone={} presses={} releases={} recoveries={} model={} "
        "states={}",
        id,
        dashed(to_string(manifest->state)),
        story.frames.size(),
        story.undone.size(),
        story.presses.size(),
        story.releases,
        manifest->recoveries,
        model,
        story.states);
    for (const auto& [reason, count] : story.refusals) {
      std::cout << fmt::format(" refused:{}={}", dashed(reason), count);
    }
    std::cout << '\n';
  }

  /// Lines "SESSION FRAMES": that many frames were acknowledged at some time.
  void check_acknowledged(const fs::path& list) {
    std::ifstream file(list);
    std::string id;
    std::size_t count = 0;
    std::size_t lines = 0;
    while (file >> id >> count) {
      ++lines;
      const auto found = frame_counts_.find(id);
      if (found == frame_counts_.end()) {
        complain(id, fmt::format("{} frames were acknowledged and it is gone", count));
      } else if (found->second + undone_counts_[id] < count) {
        complain(id,
                 fmt::format("{} frames were acknowledged, {} are there", count, found->second));
      }
    }
    if (!file.eof()) {
      complain(list.string(), fmt::format("line {} cannot be read", lines + 1));
    }
    std::cout << fmt::format("acknowledged: {} lines hold\n", lines);
  }

  /// How long presses took to be stored; nothing without stills.
  void tell_latencies() {
    if (still_latencies_.empty()) {
      return;
    }
    std::sort(still_latencies_.begin(), still_latencies_.end());
    const auto at = [&](double share) {
      const auto last = static_cast<double>(still_latencies_.size() - 1);
      const auto place = static_cast<std::size_t>(share * last);
      return std::chrono::duration<double, std::milli>(still_latencies_[place]).count();
    };
    std::cout << fmt::format(
        "press to stored, ms, of {} stills: least {:.0f} median {:.0f} p90 {:.0f} most {:.0f}\n",
        still_latencies_.size(),
        at(0.0),
        at(0.5),
        at(0.9),
        at(1.0));
  }

  void complain(const std::string& what, const std::string& why) {
    std::cout << fmt::format("WRONG {}: {}\n", what, why);
    ++faults_;
  }

  [[nodiscard]] std::size_t faults() const { return faults_; }

 private:
  /// "model ready" as one word, for scripts.
  static std::string dashed(std::string_view text) {
    std::string word(text);
    std::replace(word.begin(), word.end(), ' ', '_');
    return word;
  }

  static Story story_of(const JournalScan& scan) {
    Story story;
    for (const JournalRecord& record : scan.records) {
      if (const auto* kept = std::get_if<FrameKept>(&record.entry)) {
        story.frames[kept->number] = *kept;
        story.journaled[kept->number] = record.monotonic;
      } else if (const auto* refused = std::get_if<FrameRefused>(&record.entry)) {
        if (refused->reason == FrameRefusal::kUndone) {
          story.frames.erase(refused->number);
          story.undone.insert(refused->number);
        } else {
          ++story.refusals[std::string(to_string(refused->reason))];
        }
      } else if (const auto* edge = std::get_if<EdgeRecord>(&record.entry)) {
        if (edge->direction == EdgeDirection::kPress) {
          story.presses.push_back(edge->kernel_time);
        } else {
          ++story.releases;
        }
      } else if (const auto* change = std::get_if<StateChange>(&record.entry)) {
        story.states += (story.states.empty() ? "" : ",") + dashed(to_string(change->state));
      }
    }
    std::sort(story.presses.begin(), story.presses.end());
    return story;
  }

  /// Of the press that a still was taken for to the writing of its record, when the frame was on
  /// the disk. A frame whose exposure had ended before that press is a wrong one.
  void check_stills(const std::string& id, const Story& story) {
    for (const auto& [number, frame] : story.frames) {
      const std::chrono::nanoseconds stored = story.journaled.at(number);
      const auto later = std::upper_bound(story.presses.begin(), story.presses.end(), stored);
      if (later == story.presses.begin()) {
        complain(id, fmt::format("frame {} was stored before any press", number));
        continue;
      }
      const std::chrono::nanoseconds press = *std::prev(later);
      const std::chrono::nanoseconds exposure =
          frame.metadata.exposure.value_or(std::chrono::nanoseconds::zero());
      if (frame.metadata.timestamp + exposure / 2 < press) {
        complain(id, fmt::format("frame {} was exposed before its press", number));
      }
      still_latencies_.push_back(stored - press);
    }
  }

  void check_frames(const fs::path& folder, const Story& story) {
    const std::string id = folder.filename().string();
    for (const auto& [number, frame] : story.frames) {
      const std::string name = frame_file_name(number);
      const auto bytes = read_file_bytes(folder / kFramesName / name, kMostFileBytes);
      if (!bytes) {
        complain(id, "frame " + name + " is lost: " + bytes.error().message);
      } else if (bytes->size() != frame.size_bytes ||
                 XXH3_64bits(bytes->data(), bytes->size()) != frame.content_hash) {
        complain(id, "frame " + name + " is not what the journal says");
      }
    }
  }

  /// A model that is visible is whole: every part that its report names can be read.
  std::string check_model(const fs::path& folder) {
    const fs::path model = folder / kModelName;
    if (!fs::exists(model)) {
      return "none";
    }
    const std::string id = folder.filename().string();
    const auto text = read_file(model / "report.json", kMostFileBytes);
    if (!text || !nlohmann::json::accept(*text)) {
      complain(id, "its model has no whole report.json");
      return "broken";
    }
    std::string parts = "report";
    for (const char* name : {"sparse.ply", "dense.ply", "mesh.ply", "textured.glb"}) {
      if (!fs::exists(model / name)) {
        continue;
      }
      if (fs::file_size(model / name) == 0) {
        complain(id, fmt::format("{} of its model is empty", name));
      }
      parts += fmt::format("+{}", fs::path(name).stem().string());
    }
    return parts;
  }

  /// What holds when nothing is being captured and no model made.
  void check_settled(const fs::path& folder, const SessionManifest& manifest, const Story& story) {
    const std::string id = folder.filename().string();
    if (manifest.frame_count != story.frames.size()) {
      complain(id,
               fmt::format("session.json tells of {} frames, the journal of {}",
                           manifest.frame_count,
                           story.frames.size()));
    }
    for (const fs::directory_entry& entry : fs::directory_iterator(folder / kFramesName)) {
      const std::string name = entry.path().filename().string();
      const auto number = frame_number_of(name);
      if (is_hidden_name(name) || (number && !story.frames.contains(*number))) {
        complain(id, "frames/" + name + " was left over");
      }
    }
  }

  bool is_settled_;
  bool takes_stills_;
  std::vector<std::chrono::nanoseconds> still_latencies_;
  std::map<std::string, std::size_t> frame_counts_;
  std::map<std::string, std::size_t> undone_counts_;
  std::size_t faults_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  fs::path root;
  fs::path acknowledged;
  bool is_settled = false;
  bool takes_stills = false;
  CLI::App app(
      "One line for each session of a store, and a line with WRONG for each frame that is lost or\n"
      "changed, each broken journal and each half model. Exit code 1 when there is one.");
  app.add_option("root", root, "folder of the sessions")->required()->check(CLI::ExistingDirectory);
  app.add_option("--acknowledged", acknowledged, "lines 'SESSION FRAMES' that were acknowledged")
      ->check(CLI::ExistingFile);
  app.add_flag("--settled", is_settled, "nothing is being captured or made: nothing is left over");
  app.add_flag("--stills",
               takes_stills,
               "every frame was taken for a press: none is older, and how long each took");
  CLI11_PARSE(app, argc, argv);
  std::vector<fs::path> folders;
  Checker checker(is_settled, takes_stills);
  for (const fs::directory_entry& entry : fs::directory_iterator(root)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_directory() && !is_hidden_name(name) && name != "lost+found") {
      folders.push_back(entry.path());
    } else if (is_settled && is_hidden_name(name)) {
      checker.complain(name, "was left over");
    }
  }
  std::sort(folders.begin(), folders.end());
  for (const fs::path& folder : folders) {
    checker.check_session(folder);
  }
  if (!acknowledged.empty()) {
    checker.check_acknowledged(acknowledged);
  }
  checker.tell_latencies();
  return checker.faults() == 0 ? 0 : 1;
}
