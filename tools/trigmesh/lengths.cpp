#include "tools/trigmesh/lengths.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace trigmesh {

Result<double> parse_length_m(std::string_view option, std::string_view text, BareNumber bare) {
  double value = 0.0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, value);
  const std::string_view unit(end, static_cast<std::size_t>(last - end));
  constexpr std::array<std::pair<std::string_view, double>, 4> kUnits{
      {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1.0}, {"", 1.0}}};
  const auto* known = std::find_if(
      kUnits.begin(), kUnits.end(), [&](const auto& candidate) { return candidate.first == unit; });
  const bool has_unit = known != kUnits.end() && (!unit.empty() || bare == BareNumber::kMetres);
  if (error != std::errc{} || !has_unit || !(value > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "{} is '{}', must be a length with its unit, as 25mm, 2.5cm or 0.025m",
                option,
                text);
  }
  return value * known->second;
}

}  // namespace trigmesh
