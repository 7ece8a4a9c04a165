#pragma once

#include <string>
#include <string_view>

#include "firmware/base/result.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// The contents of bundle.out and list.txt.
struct BundlerText {
  std::string bundle;
  std::string list;
};

/// Bundler v0.3 (Snavely, Seitz, Szeliski: "Photo tourism", SIGGRAPH 2006): registered views only;
/// cameras look along -z with y up; pixels are measured from the principal point with y up. One
/// focal length and two radial terms are all that the format has: kUnsupported when a camera needs
/// more (fisheye, tangential distortion, or fx and fy so different that the error at the border
/// exceeds 0.1 pixels). Programs that take the image centre for the principal point are off by the
/// difference. `image_folder` stands before the names in list.txt, as seen from its folder.
[[nodiscard]] Result<BundlerText> write_bundler(const Scene& scene, std::string_view image_folder);

}  // namespace trigmesh
