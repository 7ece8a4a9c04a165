#include "firmware/video/video_file.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "firmware/base/atomic_files.hpp"
#include "firmware/base/check.hpp"
#include "firmware/base/child_process.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/video/frame_times.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

// A file of text has no control character in its first bytes, a video always has.
constexpr std::size_t kLookedAtBytes = 4096;
constexpr std::size_t kMaxAnswerBytes = std::size_t{1} << 20U;
// What a pixel takes in these JPEG files at least, measured: 0.16 on synthetic frames of 640x480.
constexpr double kJpegBytesPerPixel = 0.1;

// Demuxers that open the file alone: no playlists, no image sequences, no scripts. Those of sound
// are here so that a file of sound is called that.
constexpr const char* kContainers =
    "mov,mp4,matroska,webm,avi,mpegts,mpeg,mpegvideo,m4v,h264,hevc,av1,obu,ivf,flv,asf,ogg,gif,nut,"
    "mxf,dv,mjpeg,yuv4mpegpipe,wav,mp3,aac,flac";

constexpr const char* kWhatIsAsked =
    "format=duration:stream=index,codec_type,codec_name,width,height,duration,nb_frames,"
    "avg_frame_rate:stream_disposition=attached_pic:stream_side_data=rotation";

/// A name that is taken as a file whatever it begins with.
std::string as_file(const fs::path& path) {
  return "file:" + path.string();
}

/// The same as a pattern for numbered pictures, in which '%' means something.
std::string as_pattern(const fs::path& folder, std::string_view pattern) {
  std::string text = "file:";
  for (const char character : folder.string()) {
    text.append(character == '%' ? 2 : 1, character);
  }
  return text.append("/").append(pattern);
}

std::vector<std::string> input_arguments(const fs::path& file) {
  return {"-protocol_whitelist", "file", "-format_whitelist", kContainers, "-i", as_file(file)};
}

/// The first line, without the part of the program that said it: that has addresses of memory.
std::string reason_in(std::string_view errors) {
  errors = errors.substr(0, errors.find('\n'));
  if (const std::size_t end = errors.find("] ");
      errors.starts_with('[') && end != std::string_view::npos) {
    errors.remove_prefix(end + 2);
  }
  return errors.empty() ? "no reason given" : std::string(errors);
}

/// Runs ffprobe or ffmpeg.
Result<ChildExit> run_tool(const ChildCommand& command,
                           const fs::path& file,
                           const std::stop_token& stop) {
  auto exit = run_child(command, stop);
  if (!exit && exit.error().code == ErrorCode::kNotFound) {
    return fail(ErrorCode::kUnsupported,
                "cannot read {} as a video: the program {} is not installed. Install it (apt-get "
                "install ffmpeg), or give a folder of pictures",
                file.string(),
                command.arguments.front());
  }
  return exit;
}

Result<std::string> ask_ffprobe(const fs::path& file, const std::stop_token& stop) {
  std::string answer;
  ChildCommand command{
      {"ffprobe", "-loglevel", "error", "-of", "json", "-show_entries", kWhatIsAsked},
      [&answer, &file](std::string_view piece) -> Result<> {
        answer.append(piece);
        if (answer.size() > kMaxAnswerBytes) {
          return fail(ErrorCode::kLimitExceeded, "{} has too many streams", file.string());
        }
        return {};
      }};
  const auto input = input_arguments(file);
  command.arguments.insert(command.arguments.end(), input.begin(), input.end());
  TM_ASSIGN_OR_RETURN(const ChildExit exit, run_tool(command, file, stop));
  if (exit.code != 0) {
    return fail(
        ErrorCode::kUnsupported,
        "cannot read {}: neither a list of photographs nor a video that ffprobe knows ({}). "
        "A video that was cut off before it was closed can often be mended with the "
        "program that recorded it",
        file.string(),
        reason_in(exit.errors));
  }
  return answer;
}

Result<> check_room(const fs::path& file,
                    const VideoStream& stream,
                    const fs::path& folder,
                    std::size_t max_frames) {
  if (!stream.frame_count) {
    return {};  // ffmpeg tells when the disk is full
  }
  if (*stream.frame_count > max_frames) {
    return fail(ErrorCode::kLimitExceeded,
                "cannot take the frames of {}: it has about {}, the limit is {}. Cut it or lower "
                "its rate, e.g. ffmpeg -i IN -t 300 -r 15 OUT.mp4",
                file.string(),
                *stream.frame_count,
                max_frames);
  }
  const auto space = real_file_system().space(folder);
  if (!space) {
    return tl::unexpected(system_error(space.error(), "cannot ask for the free space of", folder));
  }
  const double needed = kJpegBytesPerPixel * static_cast<double>(*stream.frame_count) *
                        stream.width_px * stream.height_px;
  if (needed > static_cast<double>(space->free_bytes)) {
    return fail(ErrorCode::kNoSpace,
                "cannot take the frames of {}: they need {:.0f} MB or more in {}, which has {:.0f} "
                "MB free",
                file.string(),
                needed / 1e6,
                folder.string(),
                static_cast<double>(space->free_bytes) / 1e6);
  }
  return {};
}

/// One decoder, two outputs: the pictures, and a line for each of them with its time.
std::vector<std::string> extraction_arguments(const fs::path& file,
                                              const VideoStream& stream,
                                              const fs::path& folder,
                                              int num_threads) {
  std::vector<std::string> arguments{
      "ffmpeg", "-nostdin", "-loglevel", "error", "-threads", std::to_string(num_threads)};
  const auto append = [&arguments](const std::vector<std::string>& more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
  };
  append(input_arguments(file));
  const std::vector<std::string> every_frame{"-map",
                                             fmt::format("0:{}", stream.index),
                                             "-fps_mode",
                                             "passthrough",
                                             "-enc_time_base",
                                             "1:1000000"};
  append(every_frame);
  append({"-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj420p", "-flags", "+bitexact"});
  append({"-sws_flags", "+accurate_rnd+bitexact", "-f", "image2"});
  append({as_pattern(folder / "images", "%06d.jpg")});
  append(every_frame);
  append({"-c:v", "wrapped_avframe", "-f", "framecrc", "-flush_packets", "1", "pipe:1"});
  return arguments;
}

/// Runs ffmpeg; the times of the frames that it wrote.
Result<std::vector<std::chrono::nanoseconds>> decode(
    ChildCommand command,
    const fs::path& file,
    std::size_t max_frames,
    const std::function<void(std::size_t)>& on_frame,
    const std::stop_token& stop,
    std::string& errors) {
  FrameTimeReader reader(max_frames);
  command.on_output = [&](std::string_view piece) -> Result<> {
    TM_RETURN_IF_ERROR(reader.add(piece));
    on_frame(reader.times().size());
    return {};
  };
  TM_ASSIGN_OR_RETURN(const ChildExit exit, run_tool(command, file, stop));
  errors = exit.errors;
  if (errors.find("No space left on device") != std::string::npos) {
    return fail(ErrorCode::kNoSpace, "no space left for the frames of {}", file.string());
  }
  if (exit.code != 0) {
    return fail(reader.times().empty() ? ErrorCode::kCorruptData : ErrorCode::kIo,
                "ffmpeg cannot decode {} (exit code {}): {}",
                file.string(),
                exit.code,
                reason_in(errors));
  }
  if (reader.times().empty()) {
    return fail(ErrorCode::kCorruptData,
                "no frame of {} can be decoded: {}",
                file.string(),
                reason_in(errors));
  }
  return reader.times();
}

/// timestamps.csv, and how many frames are in it: those that are later than all before.
std::pair<std::string, std::size_t> time_table(const std::vector<std::chrono::nanoseconds>& times) {
  std::string table = "name,timestamp_ns\n";
  std::size_t listed = 0;
  std::chrono::nanoseconds latest{-1};
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (times[i] > latest) {
      latest = times[i];
      ++listed;
      fmt::format_to(std::back_inserter(table), "{:06}.jpg,{}\n", i + 1, latest.count());
    }
  }
  return {std::move(table), listed};
}

std::vector<std::string> warnings_of(const VideoStream& stream,
                                     std::size_t decoded,
                                     std::size_t listed,
                                     bool has_errors) {
  std::vector<std::string> warnings;
  if (has_errors && stream.frame_count && decoded < *stream.frame_count) {
    warnings.push_back(
        fmt::format("the video is damaged or was cut off: {} of about {} frames could be decoded",
                    decoded,
                    *stream.frame_count));
  } else if (has_errors) {
    warnings.emplace_back("the video is damaged: some of its frames may show nonsense");
  }
  if (listed < decoded) {
    warnings.push_back(
        fmt::format("{} frames of the video do not follow the one before in time and are not used",
                    decoded - listed));
  }
  return warnings;
}

}  // namespace

bool is_binary_file(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    return false;
  }
  std::ifstream file(path, std::ios::binary);
  std::string beginning(kLookedAtBytes, '\0');
  file.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(file.gcount()));
  return std::any_of(beginning.begin(), beginning.end(), [](char character) {
    return static_cast<unsigned char>(character) < 0x20 &&
           std::string_view("\t\n\v\f\r").find(character) == std::string_view::npos;
  });
}

Result<VideoStream> probe_video(const fs::path& file, const std::stop_token& stop) {
  TM_ASSIGN_OR_RETURN(const std::string answer, ask_ffprobe(file, stop));
  return parse_video_stream(answer, file.string());
}

Result<ExtractedFrames> extract_frames(const fs::path& file,
                                       const VideoStream& stream,
                                       const fs::path& folder,
                                       const ExtractionOptions& options,
                                       const std::function<void(std::size_t)>& on_frame,
                                       const std::stop_token& stop) {
  TM_RETURN_IF_ERROR(check_room(file, stream, folder, options.max_frames));
  TM_RETURN_IF_ERROR(make_directory(folder / "images"));
  std::string errors;
  TM_ASSIGN_OR_RETURN(const auto times,
                      decode({extraction_arguments(file, stream, folder, options.num_threads), {}},
                             file,
                             options.max_frames,
                             on_frame,
                             stop,
                             errors));
  const auto [table, listed] = time_table(times);
  TM_RETURN_IF_ERROR(write_file_atomically(folder / "timestamps.csv", table, Durability::kCache));
  return ExtractedFrames{listed, warnings_of(stream, times.size(), listed, !errors.empty())};
}

}  // namespace trigmesh
