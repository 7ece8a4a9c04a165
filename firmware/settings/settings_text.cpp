#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "firmware/settings/settings.hpp"
#include "firmware/settings/settings_description.hpp"

namespace trigmesh {
namespace {

constexpr std::string_view kPreamble =
    "# Settings of trigmeshd. Every key has its default here; a key that is left out keeps it.\n"
    "# `trigmeshd --check` reads this file and says what is wrong with it.\n";

/// A TOML string. The reader accepts no control characters, so these two are all to escape.
std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
    }
    result += c;
  }
  result += '"';
  return result;
}

/// The shortest text that is a TOML float and reads back as the same double.
std::string exact(double value) {
  std::string text = fmt::format("{}", value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string key_text(int marker) {
  return fmt::format("{}", marker);
}

std::string key_text(const std::pair<int, int>& markers) {
  return fmt::format("{}-{}", markers.first, markers.second);
}

/// A table of numbers on one line.
template <typename Key>
std::string table_text(const std::map<Key, double>& values) {
  std::vector<std::string> entries;
  for (const auto& [key, value] : values) {
    entries.push_back(fmt::format("{} = {}", key_text(key), exact(value)));
  }
  return entries.empty() ? "{}" : fmt::format("{{ {} }}", fmt::join(entries, ", "));
}

std::string_view truth_text(bool value) {
  return value ? "true" : "false";
}

/// Takes the values off the settings as TOML; see visit_settings.
class ValueTexts {
 public:
  void section(std::string_view /*name*/, std::string_view /*about*/) {}

  template <typename Enum, std::size_t kCount>
  void choice(const KeyText& /*key*/, Enum value, const Choices<kCount>& names) {
    add(in_quotes(names.at(static_cast<std::size_t>(value))));
  }

  void text(const KeyText& /*key*/, const std::string& value) { add(in_quotes(value)); }

  void whole(const KeyText& /*key*/, int value, Range<int> /*range*/) {
    add(fmt::format("{}", value));
  }

  template <typename Duration>
  void time(const KeyText& /*key*/, Duration value, Range<int> /*range*/) {
    add(fmt::format("{}", value.count()));
  }

  void number(const KeyText& /*key*/, double value, Range<double> /*range*/) { add(exact(value)); }

  void truth(const KeyText& /*key*/, bool value) { add(std::string(truth_text(value))); }

  template <typename Key>
  void table(const KeyText& /*key*/, const std::map<Key, double>& value, Range<double> /*range*/) {
    add(table_text(value));
  }

  /// The values as TOML, in the order of the file.
  [[nodiscard]] const std::vector<std::string>& values() const { return values_; }

 private:
  void add(std::string value) { values_.push_back(std::move(value)); }

  std::vector<std::string> values_;
};

/// Writes each key with its words, value and default, which come in the order of the visit.
class Writer {
 public:
  Writer(std::vector<std::string> values, std::vector<std::string> defaults)
      : values_(std::move(values)), defaults_(std::move(defaults)) {}

  void section(std::string_view name, std::string_view about) {
    text_ += fmt::format("\n# {}\n[{}]\n", about, name);
  }

  template <typename Enum, std::size_t kCount>
  void choice(const KeyText& key, Enum& /*value*/, const Choices<kCount>& names) {
    add(key, fmt::format("\"{}\"", fmt::join(names, "\", \"")));
  }

  void text(const KeyText& key, std::string& /*value*/) { add(key, "a text"); }

  void whole(const KeyText& key, int& /*value*/, Range<int> range) {
    add(key, fmt::format("whole, [{}, {}]", range.min, range.max));
  }

  template <typename Duration>
  void time(const KeyText& key, Duration& /*value*/, Range<int> range) {
    add(key, fmt::format("whole, [{}, {}]", range.min, range.max));
  }

  void number(const KeyText& key, double& /*value*/, Range<double> range) {
    add(key, fmt::format("[{}, {}]", exact(range.min), exact(range.max)));
  }

  void truth(const KeyText& key, bool& /*value*/) { add(key, "true, false"); }

  template <typename Key>
  void table(const KeyText& key, std::map<Key, double>& /*value*/, Range<double> range) {
    add(key, fmt::format("a table, values in [{}, {}]", exact(range.min), exact(range.max)));
  }

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void add(const KeyText& key, std::string_view range) {
    const std::string unit = key.unit.empty() ? "" : fmt::format("Unit: {}. ", key.unit);
    text_ += fmt::format("# {}.\n# {}Range: {}. Default: {}.\n{} = {}\n",
                         key.about,
                         unit,
                         range,
                         defaults_.at(next_),
                         key.name,
                         values_.at(next_));
    ++next_;
  }

  std::vector<std::string> values_;
  std::vector<std::string> defaults_;
  std::size_t next_ = 0;
  std::string text_{kPreamble};
};

std::vector<std::string> values_of(Settings settings) {
  ValueTexts texts;
  visit_settings(settings, texts);
  return texts.values();
}

}  // namespace

std::string render_settings(const Settings& settings) {
  Writer writer(values_of(settings), values_of(Settings{}));
  Settings visited = settings;
  visit_settings(visited, writer);
  return writer.text();
}

}  // namespace trigmesh
