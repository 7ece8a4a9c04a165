#pragma once

#include <cstdint>
#include <string>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/build_options.hpp"

namespace CLI {
class App;
}

namespace trigmesh {

/// Options of the stages after mapping as they come from the command line; shared by the
/// subcommands that run them.
struct SurfaceArguments {
  std::string preset = "standard";
  int max_faces = 0;
  int texture_size_px = 4096;
  int depth_size_px = 0;
  std::string moving = "auto";
  int threads = 0;
  std::uint64_t memory_limit_bytes = 0;
  std::uint64_t seed = 0;
  bool quiet = false;
};

/// Adds --preset, --depth-size, --max-faces, --texture-size, --moving, --threads, --memory-limit,
/// --seed and --quiet. `arguments` outlives the parsing.
void add_surface_options(CLI::App& command, SurfaceArguments& arguments);

/// The stages up to `last`, as the arguments want them.
[[nodiscard]] BuildOptions build_options_from(const SurfaceArguments& arguments, LastStage last);

/// The number of threads that was asked for, or one a core.
[[nodiscard]] int threads_from(const SurfaceArguments& arguments);

}  // namespace trigmesh
