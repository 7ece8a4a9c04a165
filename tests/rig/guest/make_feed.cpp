// Pictures for the cameras of the test rig, made on the host from a folder of photographs.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <vector>

#include <CLI/CLI.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/imaging/frame_image.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace {

namespace fs = std::filesystem;
using namespace trigmesh;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kMostPhotographBytes = 64'000'000;

struct Wish {
  fs::path photographs;
  fs::path output;
  int width_px = 320;
  int height_px = 240;
  int count = 12;
  /// Of the JPEG that the service makes of raw frames; the setting capture.jpeg_quality.
  int stored_quality = 95;
};

/// Red, green, blue to YUYV of BT.601 in video range; two rows share their chroma.
Bytes yuyv_of(const cv::Mat& rgb) {
  cv::Mat planes;
  cv::cvtColor(rgb, planes, cv::COLOR_RGB2YUV_I420);
  const std::uint8_t* luma = planes.ptr();
  const int half = rgb.cols / 2;
  const std::uint8_t* blue = luma + rgb.total();
  const std::uint8_t* red = blue + rgb.total() / 4;
  Bytes bytes;
  bytes.reserve(rgb.total() * 2);
  for (int y = 0; y < rgb.rows; ++y) {
    for (int x = 0; x < half; ++x) {
      const std::uint8_t* pair = luma + y * rgb.cols + 2 * x;
      const int chroma = y / 2 * half + x;
      bytes.insert(bytes.end(), {pair[0], blue[chroma], pair[1], red[chroma]});
    }
  }
  return bytes;
}

Result<> write(const fs::path& path, const Bytes& bytes, std::ios::openmode mode = {}) {
  std::ofstream file(path, std::ios::binary | mode);
  file.write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  file.close();
  return file ? Result<>() : fail(ErrorCode::kIo, "cannot write {}", path.string());
}

Result<> add_frame(const Wish& wish, const fs::path& photograph, int number) {
  TM_ASSIGN_OR_RETURN(const Bytes file, read_file_bytes(photograph, kMostPhotographBytes));
  DecodeOptions options;
  options.channels = ImageChannels::kRgb;
  TM_ASSIGN_OR_RETURN(const DecodedImage image, decode_image(file, options));
  cv::Mat small;
  cv::resize(image.rgb, small, {wish.width_px, wish.height_px}, 0.0, 0.0, cv::INTER_AREA);
  const std::string name = fmt::format("{:03}.jpg", number);
  TM_ASSIGN_OR_RETURN(const Bytes camera_jpeg, encode_jpeg(small));
  TM_RETURN_IF_ERROR(write(wish.output / "mjpg" / name, camera_jpeg));
  const Bytes raw = yuyv_of(small);
  TM_RETURN_IF_ERROR(write(wish.output / "feed.yuyv", raw, std::ios::app));
  const FrameLayout layout{.format = PixelFormat::kYuyv,
                           .width_px = wish.width_px,
                           .height_px = wish.height_px,
                           .stride_bytes = static_cast<std::size_t>(wish.width_px) * 2};
  TM_ASSIGN_OR_RETURN(const Bytes stored, jpeg_of_frame(layout, raw, wish.stored_quality));
  return write(wish.output / "stored" / name, stored);
}

Result<> make_feed(const Wish& wish) {
  std::vector<fs::path> photographs;
  for (const fs::directory_entry& entry : fs::directory_iterator(wish.photographs)) {
    photographs.push_back(entry.path());
  }
  std::sort(photographs.begin(), photographs.end());
  if (photographs.size() < static_cast<std::size_t>(wish.count)) {
    return fail(ErrorCode::kInvalidArgument,
                "{} has {} photographs, {} are wanted",
                wish.photographs.string(),
                photographs.size(),
                wish.count);
  }
  fs::create_directories(wish.output / "mjpg");
  fs::create_directories(wish.output / "stored");
  fs::remove(wish.output / "feed.yuyv");
  for (int i = 0; i < wish.count; ++i) {
    const std::size_t place =
        photographs.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(wish.count);
    TM_RETURN_IF_ERROR(add_frame(wish, photographs[place], i));
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Wish wish;
  CLI::App app(
      "Makes what the cameras of the test rig show, evenly spread over a folder of photographs:\n"
      "feed.yuyv (raw frames), stored/ (the JPEG that the service has to make of each of them)\n"
      "and mjpg/ (the JPEG of a camera that compresses by itself).");
  app.add_option("photographs", wish.photographs, "folder of photographs")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("output", wish.output, "folder to write")->required();
  app.add_option("--count", wish.count, "frames")->check(CLI::Range(1, 1000));
  app.add_option("--width", wish.width_px, "pixels, even")->check(CLI::Range(16, 4096));
  app.add_option("--height", wish.height_px, "pixels, even")->check(CLI::Range(16, 4096));
  CLI11_PARSE(app, argc, argv);
  if (const Result<> made = make_feed(wish); !made) {
    std::cerr << "rig_make_feed: " << made.error().message << '\n';
    return 1;
  }
  return 0;
}
