#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace trigmesh::test_support {

/// How a program ended.
struct ProgramResult {
  int exit_code = -1;  ///< 128 + the signal when one ended it; 127 when it could not be started
  std::string out;
  std::string err;
};

/// Runs a program found by path or in PATH with these arguments, nothing on stdin, in the current
/// folder, and waits. It is killed (exit code 137) after the time limit. QT_QPA_PLATFORM=offscreen
/// is set, for COLMAP.
[[nodiscard]] ProgramResult run_program(const std::vector<std::string>& command,
                                        std::chrono::seconds time_limit = std::chrono::seconds(60));

/// Runs the built `trigmesh` as a user does: `run_trigmesh({"export", model, ...})`.
[[nodiscard]] ProgramResult run_trigmesh(
    std::vector<std::string> arguments, std::chrono::seconds time_limit = std::chrono::seconds(60));

/// The built `trigmesh`, for tests that start it through another program.
[[nodiscard]] std::string program_path();

/// Where a program of this name is in PATH.
[[nodiscard]] std::optional<std::filesystem::path> find_program(const std::string& name);

/// A file of this repository, by its path from the root.
[[nodiscard]] std::filesystem::path source_path(const std::filesystem::path& relative);

/// The bytes of a file.
[[nodiscard]] std::string contents(const std::filesystem::path& file);

/// Every file below a folder by its relative name.
[[nodiscard]] std::map<std::string, std::string> all_files(const std::filesystem::path& folder);

/// A folder of its own for every test, removed afterwards.
class ScratchTest : public ::testing::Test {
 protected:
  /// A path in the folder.
  [[nodiscard]] std::string path(const std::string& relative) const {
    return (folder_ / relative).string();
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
};

}  // namespace trigmesh::test_support
