#pragma once

#include <string>

namespace trigmesh::test_support {

/// A report page with everything that a page can have: the globe of tests/support photographed from
/// a ring of cameras (rendered and measured by casting rays at a sphere), its mesh, depth pictures
/// and made-up numbers. One image is refused.
[[nodiscard]] std::string sample_report_page();

/// The same page without the mesh in it, as if the mesh were too large.
[[nodiscard]] std::string sample_report_page_without_mesh();

/// How many depth pictures the page has.
inline constexpr int kSampleDepthPictures = 6;

}  // namespace trigmesh::test_support
