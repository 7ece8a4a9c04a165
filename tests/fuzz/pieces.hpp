#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace trigmesh::fuzz {

/// The input of a target that reads three files at once: the files one after the other, with this
/// line between them. A text, so that the corpus can be read and the fuzzer can move the border.
inline constexpr std::string_view kBorder = "\n===\n";

inline std::string_view as_text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// What stands before the next border; `text` goes on behind it.
inline std::string next_piece(std::string_view& text) {
  const std::size_t end = text.find(kBorder);
  const std::string piece(text.substr(0, end));
  text.remove_prefix(end == text.npos ? text.size() : end + kBorder.size());
  return piece;
}

/// cameras, images and points of `Contents`.
template <typename Contents>
Contents split_model(std::string_view text) {
  Contents contents;
  contents.cameras = next_piece(text);
  contents.images = next_piece(text);
  contents.points = std::string(text);
  return contents;
}

}  // namespace trigmesh::fuzz
