#include "firmware/pipeline/walk_follower.hpp"

#include <algorithm>
#include <utility>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/pipeline/memory_plan.hpp"

namespace trigmesh {

namespace {

// As many photographs back is more than a neighbour: the place was left and came again.
constexpr std::size_t kLoop = 20;
constexpr std::size_t kMaxPhotoBytes = std::size_t{256} << 20U;

}  // namespace

Result<std::unique_ptr<WalkFollower>> WalkFollower::create(const ReconstructionOptions& options,
                                                           const std::filesystem::path& work,
                                                           const std::stop_token& stop) {
  TM_RETURN_IF_ERROR(options.validate());
  TM_ASSIGN_OR_RETURN(CheckpointFolder checkpoints, CheckpointFolder::open(work));
  std::unique_ptr<WalkFollower> follower(new WalkFollower(options, std::move(checkpoints), stop));
  TM_ASSIGN_OR_RETURN(const MemoryPlan plan,
                      plan_memory({kPlannedPhotographs, 0, options.num_threads},
                                  options.features,
                                  options.memory_limit_bytes));
  TM_ASSIGN_OR_RETURN(
      PhotoExtractor extractor,
      PhotoExtractor::create(options.feature_kind, plan.features, follower->checkpoints_));
  follower->extractor_ = std::make_unique<PhotoExtractor>(std::move(extractor));
  TM_ASSIGN_OR_RETURN(SequenceMatcher matcher,
                      SequenceMatcher::create(
                          walk_matching_options(options), follower->pool_, follower->checkpoints_));
  follower->matcher_ = std::make_unique<SequenceMatcher>(std::move(matcher));
  return follower;
}

WalkFollower::WalkFollower(const ReconstructionOptions& options,
                           CheckpointFolder checkpoints,
                           const std::stop_token& stop)
    : options_(options), checkpoints_(std::move(checkpoints)), pool_(options.num_threads, stop) {
  photos_.read = [this](std::size_t i) { return read_file_bytes(files_[i], kMaxPhotoBytes); };
}

Result<WalkState> WalkFollower::add(const std::string& name, const std::filesystem::path& file) {
  photos_.names.push_back(name);
  files_.push_back(file);
  try {
    return follow(files_.size() - 1);
  } catch (const WorkStopped&) {
    return fail(ErrorCode::kCancelled, "stopped; what was found of the walk is kept");
  }
}

Result<WalkState> WalkFollower::follow(std::size_t photo) {
  TM_ASSIGN_OR_RETURN(ExtractedImage image, (*extractor_)(photos_, photo));
  duplicates_.refuse_duplicate(photos_.names[photo], image);
  images_.push_back(std::move(image));
  TM_ASSIGN_OR_RETURN(const CameraGroups cameras, groups_so_far());
  const CameraId camera = cameras.group_of_image.back();
  const CameraGroup group = images_.back().features ? cameras.groups[index(camera)] : CameraGroup{};
  TM_ASSIGN_OR_RETURN(const auto pairs, matcher_->add({&images_.back(), group, camera}));
  TM_RETURN_IF_ERROR(matcher_->catch_up());
  const bool closes_loop = std::any_of(pairs.begin(), pairs.end(), [](const PairRecord& record) {
    return shows_one_scene(record.geometry.kind) &&
           index(record.pair.second) - index(record.pair.first) >= kLoop;
  });
  return WalkState{matcher_->following(), images_.size(), matcher_->tracked_count(), closes_loop};
}

Result<CameraGroups> WalkFollower::groups_so_far() const {
  std::vector<GroupingImage> images;
  for (std::size_t i = 0; i < images_.size(); ++i) {
    images.push_back({photos_.names[i], images_[i].features ? &*images_[i].features : nullptr});
  }
  return group_cameras(images, options_.cameras, options_.grouping);
}

}  // namespace trigmesh
