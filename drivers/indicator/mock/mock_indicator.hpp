#pragma once

#include <optional>
#include <vector>

#include "drivers/indicator/indicator.hpp"

namespace trigmesh {

/// An indicator that is none: writes down what it was shown, for tests of what stands above.
class MockIndicator final : public Indicator {
 public:
  [[nodiscard]] DeviceResult<> show(const IndicatorLevels& levels) override {
    if (fault) {
      return device_fault(*fault, "the mock indicator says: {}", to_string(*fault));
    }
    shown.push_back(levels);
    return {};
  }

  std::vector<IndicatorLevels> shown;  ///< every call in order
  std::optional<FaultKind> fault;      ///< what the next calls meet
};

}  // namespace trigmesh
