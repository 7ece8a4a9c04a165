// Whether a JPEG shows the colour bars of a video test pattern: a wrong order of colours exchanges
// bars, a wrong distance of rows bends them.

#include <array>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "sfm/exchange/image_codec.hpp"

namespace {

namespace fs = std::filesystem;
using namespace trigmesh;

constexpr std::size_t kMostBytes = 64'000'000;

/// White, yellow, cyan, green, magenta, red, blue, black: what is on of red, green, blue.
constexpr std::array<std::string_view, 8> kBars = {
    "RGB", "RG-", "-GB", "-G-", "R-B", "R--", "--B", "---"};

/// The channels that are on, of bars at three quarters of full brightness.
std::string colour_of(const cv::Vec3b& pixel) {
  constexpr int kOn = 96;
  std::string text = "---";
  for (int channel = 0; channel < 3; ++channel) {
    if (pixel[channel] > kOn) {
      text[static_cast<std::size_t>(channel)] = "RGB"[channel];
    }
  }
  return text;
}

Result<> check_bars(const fs::path& path) {
  TM_ASSIGN_OR_RETURN(const std::vector<std::uint8_t> bytes, read_file_bytes(path, kMostBytes));
  DecodeOptions options;
  options.channels = ImageChannels::kRgb;
  TM_ASSIGN_OR_RETURN(const DecodedImage image, decode_image(bytes, options));
  // Above and below the text that the pattern shows, from a tenth to half of the height.
  for (const double height : {0.04, 0.6, 0.95}) {
    const int row = static_cast<int>(height * image.rgb.rows);
    std::string seen;
    for (std::size_t bar = 0; bar < kBars.size(); ++bar) {
      const int column = (2 * static_cast<int>(bar) + 1) * image.rgb.cols / 16;
      const std::string colour = colour_of(image.rgb.at<cv::Vec3b>(row, column));
      seen += colour + " ";
      if (colour != kBars[bar]) {
        return fail(ErrorCode::kCorruptData,
                    "row {} of {}: bar {} is {} and should be {}; so far: {}",
                    row,
                    path.string(),
                    bar,
                    colour,
                    kBars[bar],
                    seen);
      }
    }
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<fs::path> files;
  CLI::App app("Whether each JPEG shows eight upright colour bars, from white to black.");
  app.add_option("files", files, "JPEG files")->required()->check(CLI::ExistingFile);
  CLI11_PARSE(app, argc, argv);
  for (const fs::path& file : files) {
    if (const Result<> checked = check_bars(file); !checked) {
      std::cerr << "rig_colour_bars: " << checked.error().message << '\n';
      return 1;
    }
  }
  return 0;
}
