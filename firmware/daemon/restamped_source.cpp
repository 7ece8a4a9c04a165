#include "firmware/daemon/restamped_source.hpp"

namespace trigmesh {

FrameEvent RestampedSource::wait(std::chrono::nanoseconds timeout) {
  FrameEvent event = source_->wait(timeout);
  if (auto* frame = std::get_if<Frame>(&event)) {
    const auto recorded = frame->info().timestamp;
    if (restamping_ == Restamping::kShifted && recorded) {
      first_time_ = first_time_.value_or(*recorded);
      frame->set_time(started_ + (*recorded - *first_time_), frame->info().moment);
    } else {
      frame->set_time(clock_.now(), FrameMoment::kExposureMiddle);
    }
  }
  return event;
}

}  // namespace trigmesh
