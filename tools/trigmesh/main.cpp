// The command line program. Each subcommand is one .cpp beside this file; see command.hpp.

#include <cstdio>
#include <exception>
#include <new>

#include <malloc.h>

#include <CLI/CLI.hpp>

#include "tools/trigmesh/command.hpp"

namespace {

constexpr const char* kFooter = R"(Examples:
  trigmesh reconstruct photos --output out
  trigmesh replay 20261125T145054Z-3fa9c1 --output again --verify
  trigmesh calibrate photos --board 9x6 --square 25mm --output camera.toml
  trigmesh evaluate out --truth truth/images.txt
  trigmesh export out --format colmap-binary --output out/colmap
  trigmesh record --seconds 20
  trigmesh export 20261125T145054Z-3fa9c1 /media/stick
`trigmesh SUBCOMMAND --help` has more.

Exit codes:
    0  done
    2  wrong option, argument or setting
    3  input that does not exist, is damaged, or is of a kind this program does not handle
    4  valid input from which the result cannot be computed, or a required quality that was missed
    5  reading or writing failed (permission, device)
    6  no space left
    7  a limit (memory, size) would be exceeded
   70  an error inside the program: please report it
  130  interrupted
)";

void add_all_commands(CLI::App& app, trigmesh::CommandContext& context) {
  trigmesh::add_reconstruct_command(app, context);
  trigmesh::add_replay_command(app, context);
  trigmesh::add_surface_commands(app, context);
  trigmesh::add_calibrate_command(app, context);
  trigmesh::add_evaluate_command(app, context);
  trigmesh::add_export_command(app, context);
  trigmesh::add_status_command(app, context);
  trigmesh::add_trigger_command(app, context);
  trigmesh::add_continue_command(app, context);
  trigmesh::add_record_command(app, context);
  trigmesh::add_watch_command(app, context);
  trigmesh::add_sessions_command(app, context);
  trigmesh::add_devices_command(app, context);
}

int run(int argc, char** argv) {
  CLI::App app{"Photographs in, cameras, coloured point cloud and textured mesh out.", "trigmesh"};
  app.set_version_flag("--version", "trigmesh " TRIGMESH_VERSION);
  app.require_subcommand(1);
  app.footer(kFooter);
  trigmesh::CommandContext context;
  add_all_commands(app, context);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      return app.exit(error);  // --help, --version
    }
    fmt::print(stderr, "trigmesh: {}\nRun with --help for more information.\n", error.what());
    return trigmesh::exit_code(trigmesh::ErrorCode::kInvalidArgument);
  }
  return context.exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  // Pictures and maps go back to the system when they are freed: glibc would raise this threshold
  // with each of them and keep their memory, which --memory-limit cannot foresee.
  ::mallopt(M_MMAP_THRESHOLD, 1 << 20);
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fputs("trigmesh: out of memory\n", stderr);
    return trigmesh::exit_code(trigmesh::ErrorCode::kLimitExceeded);
  } catch (const std::exception& error) {
    fmt::print(stderr, "trigmesh: internal error: {}\n", error.what());
    return trigmesh::exit_code(trigmesh::ErrorCode::kInternal);
  }
}
