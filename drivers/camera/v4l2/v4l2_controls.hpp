#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera_controls.hpp"
#include "drivers/camera/control_lock.hpp"
#include "drivers/camera/v4l2/kernel.hpp"

namespace trigmesh {

/// Controls of a V4L2 camera. Exposure is in microseconds, white balance in kelvin, gain and focus
/// in the camera's own units.
class V4l2Controls final : public CameraControls {
 public:
  explicit V4l2Controls(std::shared_ptr<Kernel> kernel) : kernel_(std::move(kernel)) {}

  /// The open device that the calls go to from now on; it outlives this or let_go() comes first.
  void attach(int fd, std::string camera);

  void let_go() { fd_ = -1; }

  [[nodiscard]] DeviceResult<std::vector<ControlRange>> list() override;
  [[nodiscard]] DeviceResult<std::int64_t> get(ControlId id) override;
  [[nodiscard]] DeviceResult<std::int64_t> set(ControlId id, std::int64_t value) override;

  [[nodiscard]] DeviceResult<std::vector<ControlValue>> lock(
      const std::vector<ControlValue>& wanted) override {
    return lock_.lock(*this, camera_, wanted);
  }

  [[nodiscard]] DeviceResult<> check_lock() override { return lock_.check(*this, camera_); }

  /// Sets what lock() held on the device that is attached now; nothing when nothing was locked.
  [[nodiscard]] DeviceResult<> restore_lock() { return lock_.restore(*this, camera_); }

  /// The exposure that is held, when one is.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> held_exposure() const;

 private:
  /// Nothing when the camera does not have it.
  [[nodiscard]] DeviceResult<std::optional<ControlRange>> find(ControlId id);
  [[nodiscard]] DeviceResult<std::int64_t> automatic_exposure_value();

  const std::shared_ptr<Kernel> kernel_;  // shared with the source and its buffers
  int fd_ = -1;
  std::string camera_;
  ControlLock lock_;
};

}  // namespace trigmesh
