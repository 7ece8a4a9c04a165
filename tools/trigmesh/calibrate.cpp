// trigmesh calibrate: photographs of a chessboard or ChArUco board in, a camera profile out.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "drivers/camera/replay/recording.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "sfm/calibration/board.hpp"
#include "sfm/calibration/calibration.hpp"
#include "sfm/exchange/camera_profile.hpp"
#include "sfm/exchange/file_io.hpp"
#include "sfm/exchange/image_codec.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/lengths.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter =
    R"(A chessboard must be seen whole in a photograph, a ChArUco board may be seen in part. Take ten or more
sharp photographs: the board tilted to all sides by 20 to 45 degrees, near and far, and out to all four corners of
the image. Do not change zoom or focus between them.

Examples:
  trigmesh calibrate photos --board 9x6 --square 25mm --output camera.toml
  trigmesh calibrate a.jpg b.jpg c.jpg d.jpg --board 9x6 --square 25mm --model radial --output camera.toml
  trigmesh calibrate photos --target charuco --board 5x7 --square 40mm --marker-size 30mm --dictionary 4x4_50 \
      --output camera.toml

Exit codes: 2 wrong option, 3 an input that cannot be read, 4 too few usable views, 5 output cannot be written.
)";

struct CalibrateOptions {
  std::vector<std::string> inputs;
  std::string board = "9x6";
  std::string square;
  std::string target = "chessboard";
  std::string marker_size;
  std::string dictionary = "4x4_50";
  std::string model = "brown-conrady";
  std::string output;
  std::string name;
};

/// A photograph and what was seen on it.
struct Photograph {
  std::string name;
  int width_px = 0;
  int height_px = 0;
  BoardDetection detection;
};

/// Columns and rows of the board from "9x6".
Result<> parse_board_size(const std::string& text, Board& board) {
  const char* end = text.data() + text.size();
  const auto columns = std::from_chars(text.data(), end, board.columns);
  const bool has_x = columns.ec == std::errc{} && columns.ptr != end && *columns.ptr == 'x';
  const auto rows = has_x ? std::from_chars(columns.ptr + 1, end, board.rows) : columns;
  if (!has_x || rows.ec != std::errc{} || rows.ptr != end) {
    return fail(
        ErrorCode::kInvalidArgument, "--board is '{}', must be two numbers as in 9x6", text);
  }
  return {};
}

Result<Board> parse_board(const CalibrateOptions& options) {
  Board board;
  if (options.target == "charuco") {
    board.kind = BoardKind::kCharuco;
  }
  TM_RETURN_IF_ERROR(parse_board_size(options.board, board));
  // A bare 25 is as often meant as millimetres as as metres.
  TM_ASSIGN_OR_RETURN(board.square_m,
                      parse_length_m("--square", options.square, BareNumber::kRefused));
  if (board.kind == BoardKind::kCharuco) {
    if (options.marker_size.empty()) {
      return fail(ErrorCode::kInvalidArgument, "--target charuco needs --marker-size");
    }
    TM_ASSIGN_OR_RETURN(board.marker_m,
                        parse_length_m("--marker-size", options.marker_size, BareNumber::kRefused));
    const auto dictionary = marker_dictionary_from_string(options.dictionary);
    if (!dictionary) {
      return fail(
          ErrorCode::kInvalidArgument,
          "--dictionary is '{}', must be 4x4_N, 5x5_N or 6x6_N with N one of 50, 100, 250, 1000",
          options.dictionary);
    }
    board.dictionary = *dictionary;
  }
  TM_RETURN_IF_ERROR(board.validate());
  return board;
}

Result<CameraModel> parse_model(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  const auto model = camera_model_from_string(name);
  if (!model) {
    return fail(ErrorCode::kInvalidArgument,
                "--model is '{}', must be pinhole, radial, brown-conrady or kannala-brandt",
                name);
  }
  return *model;
}

/// The files that the arguments mean: pictures as they are, folders and recordings opened.
Result<std::vector<std::filesystem::path>> list_pictures(const std::vector<std::string>& inputs) {
  std::vector<std::filesystem::path> pictures;
  for (const std::string& input : inputs) {
    std::error_code error;
    if (std::filesystem::is_directory(input, error)) {
      TM_ASSIGN_OR_RETURN(const Recording recording, Recording::open(input));
      for (const RecordedFrame& frame : recording.frames()) {
        pictures.push_back(frame.path);
      }
    } else {
      pictures.emplace_back(input);
    }
  }
  return pictures;
}

Result<Photograph> look_at(const std::filesystem::path& path, const Board& board) {
  TM_ASSIGN_OR_RETURN(const auto bytes, read_file_bytes(path, RecordingOptions{}.max_frame_bytes));
  auto image = decode_image(bytes, {.channels = ImageChannels::kGrey});
  if (!image) {
    return fail(image.error().code, "cannot read {}: {}", path.string(), image.error().message);
  }
  Photograph photograph{.name = path.filename().string(),
                        .width_px = image->grey.cols,
                        .height_px = image->grey.rows,
                        .detection = {}};
  TM_ASSIGN_OR_RETURN(photograph.detection, detect_board(image->grey, board));
  return photograph;
}

/// Reads all pictures. Those that cannot be read, or do not show the board, are reported and left
/// out.
Result<std::vector<Photograph>> look_at_all(const std::vector<std::filesystem::path>& pictures,
                                            const Board& board) {
  std::vector<Photograph> usable;
  std::string reasons;
  for (const std::filesystem::path& path : pictures) {
    auto photograph = look_at(path, board);
    std::string problem;
    if (!photograph) {
      if (photograph.error().code == ErrorCode::kInternal) {
        return tl::unexpected<Error>(photograph.error());
      }
      problem = photograph.error().message;
    } else {
      problem = photograph->detection.problem;
    }
    if (!problem.empty()) {
      reasons += fmt::format("\n  {}: {}", path.filename().string(), problem);
      continue;
    }
    usable.push_back(std::move(*photograph));
  }
  if (!reasons.empty()) {
    fmt::print("left out:{}\n", reasons);
  }
  if (usable.size() < kMinCalibrationViews) {
    return fail(
        ErrorCode::kInsufficientData,
        "cannot calibrate: the board is found in {} of {} photographs, at least {} are needed{}",
        usable.size(),
        pictures.size(),
        kMinCalibrationViews,
        reasons);
  }
  return usable;
}

Result<> check_sizes(const std::vector<Photograph>& photographs) {
  const Photograph& first = photographs.front();
  for (const Photograph& p : photographs) {
    if (p.width_px != first.width_px || p.height_px != first.height_px) {
      return fail(ErrorCode::kInvalidArgument,
                  "cannot calibrate one camera from photographs of different sizes: {} is {}x{}, "
                  "{} is {}x{}",
                  first.name,
                  first.width_px,
                  first.height_px,
                  p.name,
                  p.width_px,
                  p.height_px);
    }
  }
  return {};
}

void print_parameter(const char* name, double value, double deviation) {
  fmt::print("  {:<4} {:>12.5f} +- {:.5f}\n", name, value, deviation);
}

void print_report(const CalibrationReport& report, const std::vector<Photograph>& photographs) {
  fmt::print("views:\n");
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    const CalibratedView& view = report.views[i];
    fmt::print("  {:<24} {:>4} corners  rms {:.3f} px  tilt {:>2.0f} deg{}\n",
               photographs[i].name,
               photographs[i].detection.corners.size(),
               view.rms_px,
               view.tilt_deg,
               view.used ? "" : "  left out: disagrees with the others");
  }
  fmt::print("camera {} {}x{}:\n",
             to_string(report.camera.model),
             report.camera.width_px,
             report.camera.height_px);
  const IntrinsicsVector values = report.camera.intrinsics();
  const std::array<const char*, 4> names{"fx", "fy", "cx", "cy"};
  for (Eigen::Index i = 0; i < 4; ++i) {
    print_parameter(names[static_cast<std::size_t>(i)], values[i], report.standard_deviation[i]);
  }
  for (int i = 0; i < distortion_count(report.camera.model); ++i) {
    print_parameter(fmt::format("d{}", i).c_str(), values[4 + i], report.standard_deviation[4 + i]);
  }
  fmt::print("rms {:.4f} px over {} corners in {} views; corners cover {:.0f} % of the image\n",
             report.rms_px,
             report.corners_used,
             report.views_used,
             100.0 * report.coverage_ratio);
  for (const std::string& warning : report.warnings) {
    fmt::print("warning: {}\n", warning);
  }
}

Result<> run_calibrate(const CalibrateOptions& options) {
  TM_ASSIGN_OR_RETURN(const Board board, parse_board(options));
  TM_ASSIGN_OR_RETURN(const CameraModel model, parse_model(options.model));
  TM_ASSIGN_OR_RETURN(const auto pictures, list_pictures(options.inputs));
  TM_ASSIGN_OR_RETURN(const auto photographs, look_at_all(pictures, board));
  TM_RETURN_IF_ERROR(check_sizes(photographs));
  std::vector<CalibrationView> views;
  for (const Photograph& photograph : photographs) {
    CalibrationView view;
    for (const BoardCorner& corner : photograph.detection.corners) {
      view.board_m.push_back(board.corner_m(corner.index));
      view.pixels.push_back(corner.pixel);
    }
    views.push_back(std::move(view));
  }
  TM_ASSIGN_OR_RETURN(const CalibrationReport report,
                      calibrate_camera(views,
                                       {.model = model,
                                        .width_px = photographs.front().width_px,
                                        .height_px = photographs.front().height_px}));
  TM_ASSIGN_OR_RETURN(
      const std::string text,
      format_camera_profile(
          {.camera = report.camera, .name = options.name, .serial = {}, .rms_px = report.rms_px}));
  print_report(report, photographs);
  TM_RETURN_IF_ERROR(write_file_atomically(options.output, text));
  fmt::print("wrote {}\n", options.output);
  return {};
}

}  // namespace

void add_calibrate_command(CLI::App& app, CommandContext& context) {
  auto options = std::make_shared<CalibrateOptions>();  // shared by the parser and the callback,
                                                        // which outlive this call
  CLI::App* command = app.add_subcommand(
      "calibrate", "Makes a camera profile from photographs of a chessboard or ChArUco board.");
  command->footer(kFooter);
  command->add_option("images", options->inputs, "Photographs (JPEG, PNG), or folders of them")
      ->required();
  command
      ->add_option("--board", options->board, "Chessboard: inner corners, as 9x6; ChArUco: squares")
      ->required();
  command
      ->add_option(
          "--square", options->square, "Side of a square, with its unit: 25mm, 2.5cm, 0.025m")
      ->required();
  command->add_option("--output,-o", options->output, "The profile to write")->required();
  command->add_option("--target", options->target, "Kind of board")
      ->check(CLI::IsMember({"chessboard", "charuco"}))
      ->capture_default_str();
  command->add_option("--marker-size",
                      options->marker_size,
                      "ChArUco: side of a marker's black square, with its unit");
  command->add_option("--dictionary", options->dictionary, "ChArUco: 4x4_50 ... 6x6_1000")
      ->capture_default_str();
  command
      ->add_option("--model",
                   options->model,
                   "Lens model: pinhole, radial, brown-conrady, kannala-brandt (fisheye)")
      ->capture_default_str();
  command->add_option("--name", options->name, "A name to keep in the profile");
  command->callback([options, &context] { finish_command(context, run_calibrate(*options)); });
}

}  // namespace trigmesh
