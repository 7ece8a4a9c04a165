#pragma once

#include <span>
#include <string_view>

namespace trigmesh {

/// The web page as report_page/bundle.mjs made it at build time, cut where the data goes. Each part
/// comes in pieces, because compilers limit the length of a string literal.
[[nodiscard]] std::span<const std::string_view> report_page_head();
[[nodiscard]] std::span<const std::string_view> report_page_tail();

}  // namespace trigmesh
