#pragma once

#include <string>

#include "drivers/camera/v4l2/kernel.hpp"
#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// Whether the input from which a device streams has a picture at all: a receiver (HDMI, analogue)
/// without a source goes on delivering frames, of noise. kNoSignal: it says that there is none.
/// Drivers that know nothing of inputs have a signal.
[[nodiscard]] DeviceResult<> check_signal(Kernel& kernel, int fd, const std::string& camera);

/// Asks the driver to tell when the signal changes (POLLPRI on its descriptor). Cameras, whose
/// driver has nothing to tell, are left alone.
void watch_signal(Kernel& kernel, int fd);

/// Takes what the driver has to tell after a POLLPRI. True: the signal is not what it was.
[[nodiscard]] bool take_signal_changes(Kernel& kernel, int fd);

}  // namespace trigmesh
