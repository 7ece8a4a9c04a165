#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/scale_stage.hpp"

namespace trigmesh {

/// What is known of markers, as it comes from the command line.
struct ScaleArguments {
  std::vector<std::string> marker_sides;
  std::vector<std::string> distances;
  std::string dictionary = "4x4_50";
  std::string up = "none";
};

void add_scale_options(CLI::App& command, ScaleArguments& arguments);

/// kInvalidArgument, naming the option: no length, no marker, something given twice.
[[nodiscard]] Result<ScaleOptions> scale_options_from(const ScaleArguments& arguments);

}  // namespace trigmesh
