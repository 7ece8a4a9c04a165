#include "drivers/camera/v4l2/camera_list.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include <linux/videodev2.h>

namespace trigmesh {
namespace {

constexpr std::array<std::string_view, 2> kLinkFolders = {"/dev/v4l/by-id", "/dev/v4l/by-path"};

/// Text of a fixed field, which need not end with a zero.
template <std::size_t N>
std::string text_of(const __u8 (&field)[N]) {
  const auto* begin = reinterpret_cast<const char*>(field);
  return {begin, ::strnlen(begin, N)};
}

/// N of "videoN".
std::optional<int> node_number(std::string_view name) {
  constexpr std::string_view kPrefix = "video";
  if (name.substr(0, kPrefix.size()) != kPrefix) {
    return std::nullopt;
  }
  name.remove_prefix(kPrefix.size());
  int number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool whole = error == std::errc{} && end == name.data() + name.size();
  return whole ? std::optional(number) : std::nullopt;
}

std::vector<std::string> video_nodes(Kernel& kernel) {
  std::vector<int> numbers;
  for (const std::string& name : kernel.list("/dev")) {
    if (const auto number = node_number(name)) {
      numbers.push_back(*number);
    }
  }
  std::sort(numbers.begin(), numbers.end());
  std::vector<std::string> paths;
  for (const int number : numbers) {
    paths.push_back(fmt::format("/dev/video{}", number));
  }
  return paths;
}

/// Links to nodes, those of the better folder first.
struct Link {
  std::string path;
  std::string target;
};

std::vector<Link> list_links(Kernel& kernel) {
  std::vector<Link> links;
  for (const std::string_view folder : kLinkFolders) {
    for (const std::string& name : kernel.list(std::string(folder))) {
      std::string path = fmt::format("{}/{}", folder, name);
      std::string target = kernel.resolve(path);
      links.push_back({std::move(path), std::move(target)});
    }
  }
  return links;
}

DeviceResult<CameraNode> describe(Kernel& kernel, const std::string& path) {
  const int fd = kernel.open(path);
  if (fd < 0) {
    return tl::unexpected<DeviceFault>(fault_of_errno(-fd, "cannot open camera", path));
  }
  v4l2_capability capability{};
  const int status = kernel.ioctl(fd, VIDIOC_QUERYCAP, &capability);
  kernel.close(fd);
  if (status < 0) {
    return tl::unexpected<DeviceFault>(fault_of_errno(-status, "cannot ask what it is:", path));
  }
  const __u32 abilities = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0U
                              ? capability.device_caps
                              : capability.capabilities;
  if ((abilities & V4L2_CAP_VIDEO_CAPTURE) == 0U || (abilities & V4L2_CAP_STREAMING) == 0U) {
    return device_fault(FaultKind::kFormatRefused,
                        "{} ({}) does not stream pictures in one plane; name a camera",
                        path,
                        text_of(capability.card));
  }
  return CameraNode{.stable_name = fmt::format("bus:{}", text_of(capability.bus_info)),
                    .path = path,
                    .driver = text_of(capability.driver),
                    .model = text_of(capability.card),
                    .bus = text_of(capability.bus_info)};
}

void name_by_link(CameraNode& node, const std::vector<Link>& links) {
  for (const Link& link : links) {
    if (link.target == node.path) {
      node.stable_name = link.path;
      return;
    }
  }
}

std::string names_of(const std::vector<CameraNode>& nodes) {
  std::string text;
  for (const CameraNode& node : nodes) {
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", node.stable_name, node.model);
  }
  return text.empty() ? "none" : text;
}

}  // namespace

std::vector<CameraNode> list_cameras(Kernel& kernel) {
  const std::vector<Link> links = list_links(kernel);
  std::vector<CameraNode> nodes;
  for (const std::string& path : video_nodes(kernel)) {
    if (DeviceResult<CameraNode> node = describe(kernel, path)) {
      name_by_link(*node, links);
      nodes.push_back(*std::move(node));
    }
  }
  return nodes;
}

DeviceResult<CameraNode> find_camera(Kernel& kernel, std::string_view name) {
  if (!name.empty() && name.front() == '/') {
    // Opened as it is: the fault tells "not there" from "may not be opened".
    const std::string given(name);
    const std::string path = kernel.resolve(given);
    if (path.empty()) {
      return device_fault(FaultKind::kNotFound, "there is no camera {}: is it plugged in?", given);
    }
    TM_ASSIGN_OR_FAULT(CameraNode node, describe(kernel, path));
    if (path != given) {
      node.stable_name = given;
    } else {
      name_by_link(node, list_links(kernel));
    }
    return node;
  }
  const std::vector<CameraNode> nodes = list_cameras(kernel);
  for (const CameraNode& node : nodes) {
    if (name.empty() || node.stable_name == name) {
      return node;
    }
  }
  return device_fault(FaultKind::kNotFound,
                      "there is no camera {}; those that may be opened: {}",
                      name.empty() ? "at all" : name,
                      names_of(nodes));
}

}  // namespace trigmesh
