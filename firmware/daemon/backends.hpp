#pragma once

#include <string>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/base/result.hpp"
#include "firmware/daemon/daemon.hpp"
#include "firmware/settings/settings.hpp"

namespace trigmesh {

// The composition root: the only place that names concrete backends.

/// The devices that the settings name; nothing is opened yet, and one that is away is no failure.
/// kInvalidArgument, kNotFound (a recording), kIo. `clock` outlives them.
[[nodiscard]] Result<DaemonDevices> make_devices(const Settings& settings, const Clock& clock);

/// What the settings name and cannot be used now, a sentence each: opens every device once and
/// closes it again.
[[nodiscard]] std::vector<std::string> unusable_devices(const Settings& settings,
                                                        const Clock& clock);

}  // namespace trigmesh
