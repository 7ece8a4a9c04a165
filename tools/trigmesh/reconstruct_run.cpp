#include "tools/trigmesh/reconstruct_run.hpp"

#include <optional>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "sfm/exchange/camera_profile.hpp"
#include "tools/trigmesh/interrupt.hpp"
#include "tools/trigmesh/progress_printer.hpp"

namespace trigmesh {

namespace {

void print_summary(const ReconstructionReport& report, const std::string& output) {
  fmt::print("{}\n", report.verdict_sentence);
  if (!report.scale.empty()) {
    fmt::print("{}\n", report.units_sentence);
  }
  for (const ImageReport& image : report.images) {
    if (image.reason != RefusalReason::kNone) {
      fmt::print("  refused {}: {} - {}\n", image.name, to_string(image.reason), image.detail);
    }
  }
  for (const ReportNote& note : report.notes) {
    fmt::print("  {}: {}\n", to_string(note.severity), note.text);
  }
  if (report.finish) {
    fmt::print("{}\n", report.finish->sentence);
    for (const FinishGap& gap : report.finish->gaps) {
      fmt::print("  {}\n", gap.advice);
    }
  }
  fmt::print(
      "{} points, mean reprojection error {:.2f} px\nresult in {}/model, open "
      "{}/model/report.html\n",
      report.overall.points,
      report.overall.mean_error_px,
      output,
      output);
}

/// Who gave a length wants metres.
Result<> check_scale(const ReconstructionReport& report, const std::string& output) {
  if (report.scale.empty() || report.metres_per_unit) {
    return {};
  }
  return fail(ErrorCode::kInsufficientData,
              "the model in {}/model has no scale, its lengths are in a unit of their own: {}",
              output,
              report.scale.front().problem);
}

}  // namespace

Result<std::vector<Camera>> read_cameras(const std::string& file) {
  TM_ASSIGN_OR_RETURN(const std::vector<CameraProfile> profiles, read_camera_file(file));
  std::vector<Camera> cameras;
  for (const CameraProfile& profile : profiles) {
    cameras.push_back(profile.camera);
  }
  return cameras;
}

Result<> run_reconstruction(const ReconstructRun& run) {
  const SteadyClock clock;
  const InterruptWatch interrupt;
  std::optional<ReconstructionSummary> summary;
  {
    ProgressPrinter printer(
        run.quiet ? ProgressPrinter::Style::kQuiet : ProgressPrinter::style_of_stderr(), clock);
    TM_ASSIGN_OR_RETURN(const PhotoSet photos, run.open(printer, interrupt.token()));
    TM_ASSIGN_OR_RETURN(
        summary, reconstruct(photos, run.output, run.options, clock, printer, interrupt.token()));
  }
  print_summary(summary->report, run.output);
  if (summary->report.components.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "no model could be made from {}; {}/model/report.html tells why for each "
                "photograph and what to do",
                run.input,
                run.output);
  }
  return check_scale(summary->report, run.output);
}

}  // namespace trigmesh
