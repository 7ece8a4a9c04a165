#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/reconstruction.hpp"

namespace trigmesh {

/// The cameras of a profile of ours or a COLMAP cameras.txt. Errors: those of read_camera_file().
[[nodiscard]] Result<std::vector<Camera>> read_cameras(const std::string& file);

/// A reconstruction from the command line.
struct ReconstructRun {
  /// Opens the input, with progress where that takes long.
  std::function<Result<PhotoSet>(ProgressListener&, const std::stop_token&)> open;
  const ReconstructionOptions& options;
  const std::string& input;   ///< as the user called it
  const std::string& output;  ///< folder
  bool quiet = false;
};

/// Makes it with progress on stderr, Ctrl-C ends it in order, and prints what it came to. Errors:
/// those of opening and of reconstruct(); kInsufficientData also when there is no model.
[[nodiscard]] Result<> run_reconstruction(const ReconstructRun& run);

}  // namespace trigmesh
