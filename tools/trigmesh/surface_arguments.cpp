#include "tools/trigmesh/surface_arguments.hpp"

#include <algorithm>
#include <thread>

#include <CLI/CLI.hpp>

namespace trigmesh {

void add_surface_options(CLI::App& command, SurfaceArguments& arguments) {
  command
      .add_option(
          "--preset",
          arguments.preset,
          "How fine: preview (a surface from the sparse points, in seconds), standard, fine "
          "(depth maps at up to full image size)")
      ->check(CLI::IsMember({"preview", "standard", "fine"}))
      ->capture_default_str();
  command
      .add_option("--depth-size",
                  arguments.depth_size_px,
                  "Longer side of the depth maps, pixels; 0 = what the preset says")
      ->check(CLI::Range(0, 8192))
      ->capture_default_str();
  command
      .add_option("--max-faces",
                  arguments.max_faces,
                  "Most triangles of the mesh; 0 = what the preset says")
      ->check(CLI::Range(0, 50'000'000))
      ->capture_default_str();
  command
      .add_option(
          "--texture-size", arguments.texture_size_px, "Largest side of a texture page, pixels")
      ->check(CLI::IsMember({"1024", "2048", "4096", "8192"}))
      ->capture_default_str();
  command
      .add_option(
          "--moving",
          arguments.moving,
          "Things that moved between the photographs: auto = find them and leave them out of "
          "dense cloud, mesh and texture (masks/ of the model shows where), off = do not look")
      ->check(CLI::IsMember({"auto", "off"}))
      ->capture_default_str();
  command
      .add_option("--threads",
                  arguments.threads,
                  "Threads that work; 0 = one a core. The result does not depend on it")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  command
      .add_option("--memory-limit",
                  arguments.memory_limit_bytes,
                  "Most memory to use, e.g. 500M or 2G; quality is lowered to keep it, and the "
                  "report says how")
      ->transform(CLI::AsSizeValue(true));
  command.add_option("--seed", arguments.seed, "Start of all random sampling")
      ->capture_default_str();
  command.add_flag("--quiet", arguments.quiet, "No progress");
}

BuildOptions build_options_from(const SurfaceArguments& arguments, LastStage last) {
  BuildOptions options;
  options.last_stage = last;
  options.preset = *quality_preset_from_string(arguments.preset);  // CLI11 has checked the names
  options.max_faces = arguments.max_faces;
  options.map_side_px = arguments.depth_size_px;
  options.moving = *moving_use_from_string(arguments.moving);
  options.texture_size_px = arguments.texture_size_px;
  return options;
}

int threads_from(const SurfaceArguments& arguments) {
  return arguments.threads > 0 ? arguments.threads
                               : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace trigmesh
