#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/camera/frame_source.hpp"
#include "firmware/base/check.hpp"

namespace trigmesh {

/// Several kinds of cameras of which the first that answers is the camera, until it is stopped.
class AutoSource final : public FrameSource {
 public:
  /// Precondition: at least one.
  explicit AutoSource(std::vector<std::unique_ptr<FrameSource>> sources)
      : sources_(std::move(sources)) {
    TM_CHECK(!sources_.empty());
  }

  /// The fault says what each of them answered; its kind is that of the first.
  [[nodiscard]] DeviceResult<> start() override {
    DeviceFault fault;
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const DeviceResult<> started = sources_[i]->start();
      if (started) {
        active_ = i;
        return {};
      }
      fault.kind = i == 0 ? started.error().kind : fault.kind;
      fault.message += (i == 0 ? "" : "; ") + started.error().message;
    }
    return tl::unexpected<DeviceFault>(std::move(fault));
  }

  void stop() override {
    for (const auto& source : sources_) {
      source->stop();
    }
  }

  [[nodiscard]] FrameEvent wait(std::chrono::nanoseconds timeout) override {
    return active().wait(timeout);
  }

  void request_stop() noexcept override {
    for (const auto& source : sources_) {
      source->request_stop();
    }
  }

  [[nodiscard]] SourceInfo info() const override { return active().info(); }

  [[nodiscard]] FrameCounters counters() const override { return active().counters(); }

  [[nodiscard]] CameraControls* controls() override { return active().controls(); }

 private:
  [[nodiscard]] FrameSource& active() const { return *sources_[active_]; }

  std::vector<std::unique_ptr<FrameSource>> sources_;
  std::size_t active_ = 0;
};

}  // namespace trigmesh
