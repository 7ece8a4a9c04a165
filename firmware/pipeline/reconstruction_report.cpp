#include "firmware/pipeline/reconstruction_report.hpp"

#include <string>

namespace trigmesh {

namespace {

std::vector<ReportSetting> report_settings(const ReconstructionOptions& options,
                                           const MemoryPlan& plan) {
  return {{"features", std::string(to_string(options.feature_kind))},
          {"features per image, at most", std::to_string(plan.features.max_keypoints)},
          {"image size doubled", plan.features.upsample ? "yes" : "no"},
          {"pairs", std::string(to_string(options.pair_mode))},
          {"seed", std::to_string(options.seed)}};
}

std::vector<IntrinsicsOrigin> origins_of(const CameraGroups& cameras) {
  std::vector<IntrinsicsOrigin> origins;
  for (const CameraGroup& group : cameras.groups) {
    origins.push_back(group.knowledge == IntrinsicsKnowledge::kGiven ? IntrinsicsOrigin::kGiven
                      : group.knowledge == IntrinsicsKnowledge::kPrior
                          ? IntrinsicsOrigin::kPriorRefined
                          : IntrinsicsOrigin::kSolved);
  }
  return origins;
}

std::vector<PairEvidence> evidence_of(const std::vector<PairRecord>& pairs) {
  std::vector<PairEvidence> evidence;
  for (const PairRecord& record : pairs) {
    evidence.push_back({record.pair,
                        record.geometry.kind,
                        record.geometry.candidates,
                        record.geometry.inliers.size()});
  }
  return evidence;
}

}  // namespace

ReconstructionReport report_on(const PhotoSet& photos,
                               const ReconstructionOptions& options,
                               const MemoryPlan& plan,
                               const CameraGroups& cameras,
                               const std::vector<PairRecord>& pairs,
                               const FinishedModels& models) {
  const std::vector<PairEvidence> evidence = evidence_of(pairs);
  const std::vector<IntrinsicsOrigin> origins = origins_of(cameras);
  ReportInput input;
  input.components = models.scaled.components;
  input.scale = models.scaled.scale;
  input.images = models.outcomes;
  input.frames = photos.frames;
  input.pairs = evidence;
  input.intrinsics_origins = origins;
  input.settings = report_settings(options, plan);
  for (const std::string& sentence : photos.warnings) {
    input.notes.push_back({NoteSeverity::kWarning, sentence});
  }
  for (const std::string& sentence : plan.lowered) {
    input.notes.push_back({NoteSeverity::kWarning, sentence});
  }
  input.software_version = options.software_version;
  input.input_description = photos.description;
  return build_report(input);
}

ReconstructionReport report_on_model(const PhotoSet& photos,
                                     const ReconstructionOptions& options,
                                     const ExistingModel& model) {
  const ReportHistory& history = model.history;
  ReportInput input;
  input.components = model.components;
  input.images = history.images;
  input.frames = history.frames;
  input.pairs = history.pairs;
  input.scale = history.scale;
  input.intrinsics_origins = history.intrinsics_origins;
  input.settings = history.settings;
  input.finish = history.finish;
  if (!model.warning.empty()) {
    input.notes.push_back({NoteSeverity::kWarning, model.warning});
  }
  input.software_version = options.software_version;
  input.input_description =
      history.input_description.empty() ? photos.description : history.input_description;
  return build_report(input);
}

}  // namespace trigmesh
