#pragma once

#include <array>
#include <limits>
#include <string_view>

#include "firmware/settings/settings.hpp"

namespace trigmesh {

/// Smallest and largest value, both allowed.
template <typename T>
struct Range {
  T min;
  T max;
};

/// Names of the values of an enumeration, in its order.
template <std::size_t kCount>
using Choices = std::array<std::string_view, kCount>;

/// What a key is for.
struct KeyText {
  std::string_view name;
  std::string_view unit;  ///< empty: none
  std::string_view about;
};

template <typename Visitor>
void visit_camera(CameraSettings& s, Visitor& v) {
  v.section("camera", "Where pictures come from.");
  v.choice({"backend", "", "The kind of camera; auto takes the first that answers"},
           s.backend,
           Choices<4>{"auto", "v4l2", "libcamera", "replay"});
  v.text(
      {"device",
       "",
       "Stable name (/dev/v4l/by-id/..), libcamera id or, for replay, a folder; empty: the first"},
      s.device);
  v.whole({"width_px", "px", "Width of a frame"}, s.width_px, {64, 16384});
  v.whole({"height_px", "px", "Height of a frame"}, s.height_px, {64, 16384});
  v.whole({"rate_hz", "frames/s", "Frames asked of the camera"}, s.rate_hz, {1, 240});
  v.choice({"format", "", "How the camera sends pixels; auto takes the best that it has"},
           s.format,
           Choices<5>{"auto", "mjpg", "yuyv", "nv12", "grey"});
  v.time({"exposure_us", "microseconds", "Exposure; 0: automatic until the session begins"},
         s.exposure,
         {0, 1'000'000});
  v.number({"gain",
            "1 = none",
            "Gain of the sensor, in units of the camera where it counts otherwise; 0: automatic "
            "until the "
            "session begins"},
           s.gain,
           {0.0, 64.0});
  v.whole({"white_balance_k", "kelvin", "Colour temperature; 0: automatic"},
          s.white_balance_k,
          {0, 15000});
  v.number(
      {"focus_dioptres",
       "1/m",
       "Focus of the lens, 0 = infinity, in units of the camera where it counts otherwise; -1: "
       "automatic"},
      s.focus_dioptres,
      {-1.0, 50.0});
  v.truth({"lock_controls", "", "Hold exposure, gain, white balance and focus during a session"},
          s.lock_controls);
  v.text({"profile", "", "Camera profile made by trigmesh calibrate; empty: solve for the lens"},
         s.profile);
  v.choice({"replay_speed",
            "",
            "Of a recording that stands for a camera; it begins anew at its end; lockstep: a frame "
            "when the one before is done with"},
           s.replay_speed,
           Choices<3>{"recorded", "fastest", "lockstep"});
}

template <typename Visitor>
void visit_trigger(TriggerSettings& s, Visitor& v) {
  v.section("trigger", "The button.");
  v.choice({"backend", "", "none: commands only"}, s.backend, Choices<2>{"none", "gpiod"});
  v.text({"chip", "", "GPIO chip of the button"}, s.chip);
  v.whole({"line", "", "Line of the chip"}, s.line, {0, 1023});
  v.choice(
      {"bias", "", "Resistor inside the chip"}, s.bias, Choices<3>{"none", "pull_up", "pull_down"});
  v.truth({"active_low", "", "The button connects the line to ground"}, s.active_low);
  v.time({"debounce_ms", "ms", "Edges that come sooner after the last are bounces"},
         s.debounce,
         {0, 100});
  v.time({"long_press_ms", "ms", "From this length on a press is long: it finishes the session"},
         s.long_press,
         {300, 10'000});
  v.time({"double_press_ms",
          "ms",
          "Longest time from a release to the press that makes it double; 0: no double press"},
         s.double_press,
         {0, 1000});
}

template <typename Visitor>
void visit_indicator(IndicatorSettings& s, Visitor& v) {
  v.section("indicator", "The light and the buzzer.");
  v.choice({"backend", "", "none: no light"}, s.backend, Choices<2>{"none", "gpiod"});
  v.text({"chip", "", "GPIO chip of the light"}, s.chip);
  v.whole({"light_line", "", "Line of the light; -1: none"}, s.light_line, {-1, 1023});
  v.whole({"buzzer_line", "", "Line of the buzzer; -1: none"}, s.buzzer_line, {-1, 1023});
  v.truth({"active_low", "", "A low line switches on"}, s.active_low);
}

template <typename Visitor>
void visit_capture(CaptureSettings& s, Visitor& v) {
  v.section("capture", "What a press does.");
  v.choice({"mode", "", "still: each short press one frame; video: a stream of frames"},
           s.mode,
           Choices<2>{"still", "video"});
  v.choice(
      {"video_trigger", "", "hold: while the button is down; toggle: a press begins, one ends"},
      s.video_trigger,
      Choices<2>{"hold", "toggle"});
  v.whole({"every_nth_sharp_frame",
           "frames",
           "In video mode, the sharpest of so many frames is kept; 0: the keyframes, chosen by "
           "motion, overlap and sharpness"},
          s.every_nth_sharp_frame,
          {0, 1000});
  v.time(
      {"still_wait_ms", "ms", "How long a press waits for its frame"}, s.still_wait, {50, 60'000});
  v.time(
      {"continue_within_s",
       "s",
       "A press so soon after a model is ready adds to its scan; 0: each press begins a new one"},
      s.continue_within,
      {0, 86'400});
  v.whole(
      {"queue_frames", "frames", "Frames between camera and storage; when full the oldest goes"},
      s.queue_frames,
      {2, 256});
  v.whole({"jpeg_quality", "", "Of frames that the camera does not send as JPEG"},
          s.jpeg_quality,
          {50, 100});
}

template <typename Visitor>
void visit_storage(StorageSettings& s, Visitor& v) {
  v.section("storage", "Where sessions are, and how much they may take.");
  v.text({"root", "", "Folder of all sessions"}, s.root);
  v.whole({"quota_mb", "MB = 1000000 bytes", "All sessions together; 0: no quota"},
          s.quota_mb,
          {0, std::numeric_limits<int>::max()});
  v.whole({"reserve_mb", "MB", "Left free by a capture, so that models can still be made"},
          s.reserve_mb,
          {10, std::numeric_limits<int>::max()});
  v.whole({"warn_mb", "MB", "The light warns when less than this can still be captured"},
          s.warn_mb,
          {0, std::numeric_limits<int>::max()});
  v.choice({"remove_old", "", "when_needed: the oldest finished sessions go when space runs out"},
           s.remove_old,
           Choices<2>{"never", "when_needed"});
  v.truth({"remove_without_model", "", "Also sessions of which there is no model"},
          s.remove_without_model);
  v.truth({"remove_not_exported", "", "Also sessions of which there is no verified copy"},
          s.remove_not_exported);
}

template <typename Visitor>
void visit_reconstruction(ReconstructionSettings& s, Visitor& v) {
  v.section("reconstruction", "How models are made after a capture.");
  v.truth({"enabled", "", "false: sessions are only kept"}, s.enabled);
  v.truth({"live",
           "",
           "Videos are mapped while they are captured, and the operator is told what to do"},
          s.live);
  v.choice(
      {"preset", "", "Time against detail"}, s.preset, Choices<3>{"preview", "standard", "fine"});
  v.whole(
      {"memory_limit_mb", "MB", "Quality is lowered by stated steps to stay below; 0: no limit"},
      s.memory_limit_mb,
      {0, 1'000'000});
  v.whole({"threads", "", "Threads at work; 0: one a core"}, s.threads, {0, 256});
  v.whole({"priority", "", "Niceness of the work: 0 as important as capturing, 19 least"},
          s.priority,
          {0, 19});
  v.whole({"seed", "", "Of random numbers: the same input and seed give the same model"},
          s.seed,
          {0, std::numeric_limits<int>::max()});
  v.time({"stall_limit_s",
          "s",
          "The service starts anew when the work on a model does not get on for this time"},
         s.stall_limit,
         {30, 86'400});
}

template <typename Visitor>
void visit_scale(ScaleSettings& s, Visitor& v) {
  v.section("scale", "Markers of known size beside the thing, for models in metres.");
  v.choice({"dictionary", "", "The ArUco dictionary that the markers are of"},
           s.dictionary,
           Choices<12>{"4x4_50",
                       "4x4_100",
                       "4x4_250",
                       "4x4_1000",
                       "5x5_50",
                       "5x5_100",
                       "5x5_250",
                       "5x5_1000",
                       "6x6_50",
                       "6x6_100",
                       "6x6_250",
                       "6x6_1000"});
  v.number({"marker_side_m",
            "m",
            "Side of the black square of every marker that is not named below, as measured on the "
            "print; 0: only those below count"},
           s.marker_side_m,
           {0.0, 2.0});
  v.table({"marker_sides_m", "m", "Sides of single markers, by number, as in { 3 = 0.12 }"},
          s.marker_sides_m,
          {0.001, 2.0});
  v.table({"marker_distances_m",
           "m",
           "Known distances between the middles of two markers, as in { 0-1 = 0.5 }"},
          s.marker_distances_m,
          {0.001, 100.0});
  v.choice({"up", "", "card: the markers lie flat, up is where they look; none: up is not known"},
           s.up,
           Choices<2>{"none", "card"});
}

template <typename Visitor>
void visit_log(LogSettings& s, Visitor& v) {
  v.section("log", "What is told to the journal of the system.");
  v.choice({"level", "", "From which importance on"},
           s.level,
           Choices<4>{"error", "warn", "info", "debug"});
  v.time({"repeat_interval_s", "s", "A failure that goes on is told again after this time"},
         s.repeat_interval,
         {1, 86'400});
}

/// Shows a visitor every section and key in the order of the file. It has the functions section,
/// choice, text, whole, number, time, truth and table.
template <typename Visitor>
void visit_settings(Settings& settings, Visitor& visitor) {
  visit_camera(settings.camera, visitor);
  visit_trigger(settings.trigger, visitor);
  visit_indicator(settings.indicator, visitor);
  visit_capture(settings.capture, visitor);
  visit_storage(settings.storage, visitor);
  visit_reconstruction(settings.reconstruction, visitor);
  visit_scale(settings.scale, visitor);
  visit_log(settings.log, visitor);
}

}  // namespace trigmesh
