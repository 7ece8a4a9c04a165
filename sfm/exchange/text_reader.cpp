#include "sfm/exchange/text_reader.hpp"

#include <algorithm>
#include <cmath>

namespace trigmesh {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

/// Foreign bytes in a message: short, and nothing that a terminal could obey.
std::string printable(std::string_view token) {
  constexpr std::size_t kLongest = 40;
  std::string text(token.substr(0, kLongest));
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return token.size() > kLongest ? text + "..." : text;
}

}  // namespace

bool TextReader::next_line() {
  while (ok() && !text_.empty()) {
    const std::size_t end = text_.find('\n');
    line_ = text_.substr(0, end);
    text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
    ++line_number_;
    if (line_.ends_with('\r')) {
      line_.remove_suffix(1);
    }
    position_ = 0;
    if (!line_.starts_with('#')) {
      return true;
    }
  }
  line_ = {};
  position_ = 0;
  return false;
}

bool TextReader::next_record() {
  while (next_line()) {
    if (!at_line_end()) {
      return true;
    }
  }
  return false;
}

bool TextReader::at_line_end() {
  while (position_ < line_.size() && is_blank(line_[position_])) {
    ++position_;
  }
  return position_ == line_.size();
}

std::string_view TextReader::word(std::string_view what) {
  if (!ok()) {
    return {};
  }
  if (at_line_end()) {
    reject(fmt::format("{} is missing", what));
    return {};
  }
  const std::size_t begin = position_;
  while (position_ < line_.size() && !is_blank(line_[position_])) {
    ++position_;
  }
  return line_.substr(begin, position_ - begin);
}

double TextReader::real(std::string_view what) {
  const std::string_view token = word(what);
  double value = 0.0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (ok() &&
      (error != std::errc{} || end != token.data() + token.size() || !std::isfinite(value))) {
    reject_field(what, token);
    return 0.0;
  }
  return value;
}

std::string_view TextReader::rest() {
  if (!ok()) {
    return {};
  }
  const std::size_t skip = position_ < line_.size() && is_blank(line_[position_]) ? 1 : 0;
  const std::string_view text = line_.substr(position_ + skip);
  position_ = line_.size();
  return text;
}

void TextReader::reject(std::string_view reason, ErrorCode code) {
  if (ok()) {
    error_ = {code, fmt::format("{}, line {}: {}", source_, line_number_, reason)};
  }
}

void TextReader::reject_field(std::string_view what, std::string_view token) {
  reject(fmt::format("'{}' is not {}", printable(token), what));
}

Result<> TextReader::status() const {
  if (ok()) {
    return {};
  }
  return tl::unexpected<Error>(error_);
}

}  // namespace trigmesh
