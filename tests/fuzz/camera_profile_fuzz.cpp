#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/base/check.hpp"
#include "sfm/exchange/camera_profile.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// Whatever is accepted is a valid camera and survives being written and read again.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto profile = trigmesh::parse_camera_profile(text, "fuzz");
  if (profile) {
    TM_CHECK(profile->camera.validate());
    const auto again =
        trigmesh::parse_camera_profile(trigmesh::format_camera_profile(*profile).value(), "again");
    TM_CHECK(again && *again == *profile);
  }
  (void)trigmesh::parse_camera_file(text, "fuzz");  // must not crash
  return 0;
}
