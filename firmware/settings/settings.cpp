#include "firmware/settings/settings.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <exception>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/settings/settings_description.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kMaxTextBytes = 1024;

/// Fewest letters to change, add or leave out (Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::string nearest(std::string_view name, const std::vector<std::string>& known) {
  constexpr std::size_t kLongestCompared = 64;
  const std::string_view compared = name.substr(0, kLongestCompared);
  return *std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return edit_distance(compared, a) < edit_distance(compared, b);
  });
}

constexpr int kMaxMarker = 999;  ///< of the largest dictionary

/// The number of a marker as the key of a table.
bool parse_key(std::string_view text, int& marker) {
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, marker);
  return error == std::errc{} && stop == end && marker >= 0 && marker <= kMaxMarker;
}

/// Two markers, "0-1", put into ascending order.
bool parse_key(std::string_view text, std::pair<int, int>& markers) {
  const std::size_t dash = text.find('-');
  if (dash == std::string_view::npos || !parse_key(text.substr(0, dash), markers.first) ||
      !parse_key(text.substr(dash + 1), markers.second)) {
    return false;
  }
  markers = std::minmax({markers.first, markers.second});
  return markers.first != markers.second;
}

constexpr std::string_view key_form(int /*of*/) {
  return "the number of a marker";
}

constexpr std::string_view key_form(const std::pair<int, int>& /*of*/) {
  return "the numbers of two markers with a dash between them";
}

/// All that is wrong with a file, by line.
class Complaints {
 public:
  explicit Complaints(std::string_view file) : file_(file) {}

  void add(const toml::node& node, std::string_view key, std::string_view what) {
    const std::size_t line = node.source().begin.line;
    lines_.emplace(line, fmt::format("{}:{}: {}: {}", file_, line, key, what));
  }

  [[nodiscard]] bool empty() const { return lines_.empty(); }

  [[nodiscard]] std::string text() const {
    std::string text;
    for (const auto& [line, message] : lines_) {
      text += (text.empty() ? "" : "\n") + message;
    }
    return text;
  }

 private:
  std::string_view file_;
  std::multimap<std::size_t, std::string> lines_;
};

/// Puts the values of a table into the settings; see visit_settings.
class Reader {
 public:
  Reader(const toml::table& root, Complaints& complaints) : root_(root), complaints_(complaints) {}

  void section(std::string_view name, std::string_view /*about*/) {
    section_ = name;
    const toml::node* node = root_.get(name);
    table_ = node == nullptr ? nullptr : node->as_table();
    if (node != nullptr && table_ == nullptr) {
      complaints_.add(*node, name, fmt::format("must be a section, [{}]", name));
    }
    known_[section_];
  }

  template <typename Enum, std::size_t kCount>
  void choice(const KeyText& key, Enum& value, const Choices<kCount>& names) {
    const toml::node* node = find(key);
    if (node == nullptr) {
      return;
    }
    const auto text = node->value_exact<std::string>();
    const auto found = text ? std::find(names.begin(), names.end(), *text) : names.end();
    if (found == names.end()) {
      complain(key, *node, fmt::format("must be one of \"{}\"", fmt::join(names, "\", \"")));
      return;
    }
    value = static_cast<Enum>(found - names.begin());
  }

  void text(const KeyText& key, std::string& value) {
    const toml::node* node = find(key);
    if (node == nullptr) {
      return;
    }
    auto found = node->value_exact<std::string>();
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' '; };
    if (!found || found->size() > kMaxTextBytes ||
        std::any_of(found->begin(), found->end(), is_control)) {
      complain(
          key, *node, fmt::format("must be one line in quotes, at most {} bytes", kMaxTextBytes));
      return;
    }
    value = *std::move(found);
  }

  void whole(const KeyText& key, int& value, Range<int> range) {
    if (const auto found = whole_in(key, range.min, range.max)) {
      value = static_cast<int>(*found);
    }
  }

  template <typename Duration>
  void time(const KeyText& key, Duration& value, Range<int> range) {
    if (const auto found = whole_in(key, range.min, range.max)) {
      value = Duration(*found);
    }
  }

  void number(const KeyText& key, double& value, Range<double> range) {
    const toml::node* node = find(key);
    if (node == nullptr) {
      return;
    }
    const auto found = node->is_number() ? node->value<double>() : std::nullopt;
    if (!found || !(*found >= range.min && *found <= range.max)) {
      complain(key, *node, fmt::format("must be a number in [{}, {}]", range.min, range.max));
      return;
    }
    value = *found;
  }

  void truth(const KeyText& key, bool& value) {
    const toml::node* node = find(key);
    if (node == nullptr) {
      return;
    }
    const auto found = node->value_exact<bool>();
    if (!found) {
      complain(key, *node, "must be true or false");
      return;
    }
    value = *found;
  }

  template <typename Key>
  void table(const KeyText& key, std::map<Key, double>& value, Range<double> range) {
    const toml::node* node = find(key);
    if (node == nullptr) {
      return;
    }
    const toml::table* entries = node->as_table();
    if (entries == nullptr) {
      complain(key, *node, fmt::format("must be a table of {} = number", key_form(Key{})));
      return;
    }
    for (const auto& [name, entry] : *entries) {
      const std::string path = fmt::format("{}.{}", key.name, name.str());
      const auto number = entry.is_number() ? entry.template value<double>() : std::nullopt;
      Key place{};
      if (!parse_key(name.str(), place)) {
        complain({path, key.unit, {}}, entry, fmt::format("the key must be {}", key_form(place)));
      } else if (!number || !(*number >= range.min && *number <= range.max)) {
        complain({path, key.unit, {}},
                 entry,
                 fmt::format("must be a number in [{}, {}]", range.min, range.max));
      } else if (!value.emplace(place, *number).second) {
        complain({path, key.unit, {}}, entry, "is there already under another name");
      }
    }
  }

  /// Complains about every key that was not asked for.
  void refuse_unknown() {
    std::vector<std::string> sections;
    for (const auto& [name, keys] : known_) {
      sections.push_back(name);
    }
    for (const auto& [name, node] : root_) {
      const auto known = known_.find(name.str());
      if (known == known_.end()) {
        complaints_.add(
            node,
            name.str(),
            fmt::format("no such section; the nearest is [{}]", nearest(name.str(), sections)));
      } else if (const toml::table* table = node.as_table()) {
        refuse_unknown_keys(*table, known->first, known->second);
      }
    }
  }

 private:
  void refuse_unknown_keys(const toml::table& table,
                           std::string_view section,
                           const std::vector<std::string>& known) {
    for (const auto& [name, node] : table) {
      if (std::find(known.begin(), known.end(), name.str()) == known.end()) {
        complaints_.add(node,
                        fmt::format("{}.{}", section, name.str()),
                        fmt::format("no such key; the nearest is {}", nearest(name.str(), known)));
      }
    }
  }

  [[nodiscard]] const toml::node* find(const KeyText& key) {
    known_[section_].emplace_back(key.name);
    return table_ == nullptr ? nullptr : table_->get(key.name);
  }

  [[nodiscard]] std::optional<std::int64_t> whole_in(const KeyText& key, int min, int max) {
    const toml::node* node = find(key);
    if (node == nullptr) {
      return std::nullopt;
    }
    const auto found = node->value_exact<std::int64_t>();
    if (!found || *found < min || *found > max) {
      complain(key, *node, fmt::format("must be a whole number in [{}, {}]", min, max));
      return std::nullopt;
    }
    return found;
  }

  void complain(const KeyText& key, const toml::node& node, const std::string& what) {
    const std::string unit = key.unit.empty() ? "" : fmt::format(" ({})", key.unit);
    complaints_.add(node, fmt::format("{}.{}", section_, key.name), what + unit);
  }

  const toml::table& root_;
  Complaints& complaints_;
  std::string section_;
  const toml::table* table_ = nullptr;
  std::map<std::string, std::vector<std::string>, std::less<>> known_;
};

/// How many markers a dictionary has.
int marker_count(ScaleSettings::Dictionary dictionary) {
  constexpr std::array kCounts{50, 100, 250, 1000};
  return kCounts.at(static_cast<std::size_t>(dictionary) % kCounts.size());
}

/// The largest number of a marker in either table; -1 when both are empty.
int largest_marker(const ScaleSettings& scale) {
  int largest = scale.marker_sides_m.empty() ? -1 : scale.marker_sides_m.rbegin()->first;
  for (const auto& [markers, metres] : scale.marker_distances_m) {
    largest = std::max(largest, markers.second);
  }
  return largest;
}

/// Values that are right alone and wrong together. `root` has at least one of the two.
void check_together(const toml::table& root, const Settings& settings, Complaints& complaints) {
  const auto complain =
      [&](const char* section, const char* first, const char* second, const char* what) {
        const toml::node* table = root.get(section);
        const toml::node* node = table->as_table()->get(first);
        complaints.add(node == nullptr ? *table->as_table()->get(second) : *node,
                       fmt::format("{}.{}", section, first),
                       what);
      };
  if (settings.trigger.long_press <= settings.trigger.debounce) {
    complain("trigger", "long_press_ms", "debounce_ms", "must be longer than debounce_ms");
  }
  if (settings.trigger.double_press.count() > 0 &&
      settings.trigger.double_press <= settings.trigger.debounce) {
    complain("trigger", "double_press_ms", "debounce_ms", "must be 0 or longer than debounce_ms");
  }
  if (settings.indicator.light_line >= 0 &&
      settings.indicator.light_line == settings.indicator.buzzer_line) {
    complain("indicator", "buzzer_line", "light_line", "is the line of the light already");
  }
  const ScaleSettings& scale = settings.scale;
  if (largest_marker(scale) >= marker_count(scale.dictionary)) {
    complain("scale",
             scale.marker_sides_m.empty() ? "marker_distances_m" : "marker_sides_m",
             "marker_distances_m",
             "a marker is not in the dictionary: numbers begin at 0 and end below its last number");
  }
  if (scale.up == ScaleSettings::Up::kCard && scale.marker_side_m == 0.0 &&
      scale.marker_sides_m.empty() && scale.marker_distances_m.empty()) {
    complain("scale", "up", "up", "card needs a side or a distance of markers");
  }
  if (settings.storage.root.empty() || settings.storage.root.front() != '/') {
    complain("storage", "root", "root", "must be a path that begins with /");
  }
}

Result<Settings> settings_from(const toml::table& root, std::string_view file) {
  Settings settings;
  Complaints complaints(file);
  Reader reader(root, complaints);
  visit_settings(settings, reader);
  reader.refuse_unknown();
  if (complaints.empty()) {
    check_together(root, settings, complaints);
  }
  if (!complaints.empty()) {
    return fail(ErrorCode::kInvalidArgument, "{}", complaints.text());
  }
  return settings;
}

}  // namespace

Result<Settings> parse_settings(std::string_view text, std::string_view file) {
  if (text.size() > kMaxSettingsBytes) {
    return fail(ErrorCode::kLimitExceeded,
                "{}: {} bytes are too many for settings, the limit is {}",
                file,
                text.size(),
                kMaxSettingsBytes);
  }
  // Deep nesting is refused by toml++ itself (TOML_MAX_NESTED_VALUES).
  try {
    return settings_from(toml::parse(text), file);
  } catch (const toml::parse_error& error) {
    return fail(ErrorCode::kInvalidArgument,
                "{}:{}: {}",
                file,
                error.source().begin.line,
                error.description());
  } catch (const std::exception& error) {
    return fail(ErrorCode::kInvalidArgument, "{}: {}", file, error.what());
  }
}

Result<Settings> load_settings(const std::filesystem::path& file) {
  TM_ASSIGN_OR_RETURN(const std::string text, read_file(file, kMaxSettingsBytes));
  return parse_settings(text, file.string());
}

}  // namespace trigmesh
