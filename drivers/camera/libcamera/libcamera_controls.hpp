#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera_controls.hpp"
#include "drivers/camera/control_lock.hpp"
#include "drivers/camera/libcamera/camera_stream.hpp"
#include "firmware/base/clock.hpp"

namespace trigmesh {

/// Controls of a libcamera camera. Exposure is in microseconds; gain and the red gain of white
/// balance are in thousandths, focus in thousandths of a dioptre. A value travels with a request
/// and shows some frames later: set() waits until a frame was taken with it, and meanwhile the
/// oldest pictures that nobody took go back to the camera. A camera that does not tell what it took
/// is believed.
class LibcameraControls final : public CameraControls {
 public:
  /// `clock` outlives this.
  explicit LibcameraControls(const Clock& clock) : clock_(clock) {}

  /// The stream that the calls go to from now on; it outlives this or let_go() comes first.
  void attach(CameraStream& stream, std::string camera);

  void let_go() { stream_ = nullptr; }

  [[nodiscard]] DeviceResult<std::vector<ControlRange>> list() override;
  [[nodiscard]] DeviceResult<std::int64_t> get(ControlId id) override;
  [[nodiscard]] DeviceResult<std::int64_t> set(ControlId id, std::int64_t value) override;

  [[nodiscard]] DeviceResult<std::vector<ControlValue>> lock(
      const std::vector<ControlValue>& wanted) override {
    return lock_.lock(*this, camera_, wanted);
  }

  [[nodiscard]] DeviceResult<> check_lock() override { return lock_.check(*this, camera_); }

  /// What lock() held, for the first request of a stream.
  [[nodiscard]] std::vector<SentControl> held() const;

  /// Sets it on the stream that is attached now and reads it back; nothing when nothing is held.
  [[nodiscard]] DeviceResult<> restore_lock() { return lock_.restore(*this, camera_); }

 private:
  /// What a camera was asked for and said that it took.
  struct Taken {
    std::int64_t asked = 0;
    std::int64_t taken = 0;
  };

  [[nodiscard]] DeviceResult<ControlRange> need(ControlId id);
  [[nodiscard]] DeviceResult<std::int64_t> settle(std::uint64_t round,
                                                  ControlId id,
                                                  std::int64_t value);
  /// The progress after more than `count` frames.
  [[nodiscard]] DeviceResult<FrameExchange::Progress> wait_for_frame(
      std::uint64_t count, std::chrono::nanoseconds deadline);

  const Clock& clock_;
  CameraStream* stream_ = nullptr;
  std::string camera_;
  std::array<std::optional<Taken>, 8> taken_;  ///< by ControlId, of this stream
  float blue_gain_ = 1.0F;
  ControlLock lock_;
};

}  // namespace trigmesh
