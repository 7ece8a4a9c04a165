// A USB camera that is plugged in while this program runs.

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <iostream>

#include <poll.h>

#include <CLI/CLI.hpp>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "tests/rig/guest/uvc_camera.hpp"

namespace {

namespace fs = std::filesystem;
using namespace trigmesh;
using namespace trigmesh::rig;

constexpr std::size_t kMostBytes = 256'000'000;

struct Wish {
  fs::path feed;
  UvcCameraModel model;
  double rate_hz = 10.0;
};

volatile std::sig_atomic_t asked_to_end = 0;

Result<UvcPictures> read_pictures(const Wish& wish) {
  UvcPictures pictures;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(wish.feed / "mjpg")) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    TM_ASSIGN_OR_RETURN(pictures.mjpg.emplace_back(), read_file_bytes(file, kMostBytes));
  }
  TM_ASSIGN_OR_RETURN(const std::vector<std::uint8_t> raw,
                      read_file_bytes(wish.feed / "feed.yuyv", kMostBytes));
  const std::size_t frame_bytes = std::size_t{2} * wish.model.width_px * wish.model.height_px;
  for (std::size_t at = 0; at + frame_bytes <= raw.size(); at += frame_bytes) {
    const auto begin = raw.begin() + static_cast<std::ptrdiff_t>(at);
    pictures.yuyv.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(frame_bytes));
  }
  if (pictures.mjpg.empty() || pictures.yuyv.empty()) {
    return fail(ErrorCode::kInvalidArgument, "{} holds no pictures", wish.feed.string());
  }
  return pictures;
}

/// Until the next picture is due or the kernel wants something.
Result<> serve(UvcCamera& camera) {
  using namespace std::chrono;
  while (asked_to_end == 0) {
    const auto now = steady_clock::now();
    const auto due = camera.next_due();
    // Looks up now and then for a signal that came just before the wait.
    const auto wait =
        due <= now ? milliseconds(0) : std::min(milliseconds(500), ceil<milliseconds>(due - now));
    pollfd entry{camera.fd(), POLLIN, 0};
    if (::poll(&entry, 1, static_cast<int>(wait.count())) > 0) {
      TM_RETURN_IF_ERROR(camera.take_request());
    }
    TM_RETURN_IF_ERROR(camera.send_due(steady_clock::now()));
  }
  return {};
}

Result<> run(const Wish& wish) {
  TM_ASSIGN_OR_RETURN(UvcPictures pictures, read_pictures(wish));
  TM_ASSIGN_OR_RETURN(UsbipPort port, UsbipPort::plug_in());
  UvcCamera camera(wish.model, std::move(pictures), std::move(port));
  std::cout << "plugged in" << std::endl;
  return serve(camera);
}

}  // namespace

int main(int argc, char** argv) {
  Wish wish;
  CLI::App app(
      "Plugs a simulated USB camera into the kernel's virtual host controller (vhci-hcd), with "
      "the\n"
      "pictures of a folder that rig_make_feed wrote. It is unplugged when the program ends.");
  app.add_option("feed", wish.feed, "folder with mjpg/ and feed.yuyv")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--width", wish.model.width_px, "pixels");
  app.add_option("--height", wish.model.height_px, "pixels");
  app.add_option("--rate", wish.rate_hz, "frames a second")->check(CLI::Range(0.1, 100.0));
  CLI11_PARSE(app, argc, argv);
  wish.model.interval_100ns = static_cast<std::uint32_t>(1e7 / wish.rate_hz);

  struct sigaction action {};

  action.sa_handler = [](int) { asked_to_end = 1; };
  (void)::sigaction(SIGTERM, &action, nullptr);
  (void)::sigaction(SIGINT, &action, nullptr);
  if (const Result<> ran = run(wish); !ran) {
    std::cerr << "rig_uvc_camera: " << ran.error().message << '\n';
    return 1;
  }
  return 0;
}
