#pragma once

#include <optional>
#include <ranges>
#include <string_view>

namespace trigmesh {

/// The one of `values` whose to_string is `name`.
template <std::ranges::range Values>
[[nodiscard]] auto named_value(const Values& values, std::string_view name)
    -> std::optional<std::ranges::range_value_t<Values>> {
  for (const auto value : values) {
    if (to_string(value) == name) {
      return value;
    }
  }
  return std::nullopt;
}

}  // namespace trigmesh
