#include "firmware/session/space_budget.hpp"

#include <algorithm>
#include <limits>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"

namespace trigmesh {
namespace {

std::uint64_t difference_or_zero(std::uint64_t a, std::uint64_t b) {
  return a > b ? a - b : 0;
}

}  // namespace

std::string_view to_string(StorageLevel level) {
  switch (level) {
    case StorageLevel::kOk:
      return "ok";
    case StorageLevel::kLow:
      return "low";
    case StorageLevel::kFull:
      return "full";
  }
  return "unknown";
}

Result<std::uint64_t> SpaceBudget::available_bytes() const {
  const SystemResult<DiskSpace> space = files_.space(root_);
  if (!space) {
    return tl::unexpected<Error>(
        system_error(space.error(), "cannot ask for the free space of", root_));
  }
  const std::uint64_t by_reserve = difference_or_zero(space->free_bytes, limits_.reserve_bytes);
  const std::uint64_t by_quota = limits_.quota_bytes == 0
                                     ? std::numeric_limits<std::uint64_t>::max()
                                     : difference_or_zero(limits_.quota_bytes, used_bytes_);
  return std::min(by_reserve, by_quota);
}

Result<> SpaceBudget::admit(std::uint64_t bytes) const {
  TM_ASSIGN_OR_RETURN(const std::uint64_t available, available_bytes());
  if (bytes > available) {
    return fail(ErrorCode::kNoSpace,
                "cannot keep {} bytes in {}: {} bytes are left of the quota ({}) and above the "
                "reserve ({}); export and remove sessions",
                bytes,
                root_.string(),
                available,
                limits_.quota_bytes,
                limits_.reserve_bytes);
  }
  return {};
}

Result<StorageLevel> SpaceBudget::level() const {
  TM_ASSIGN_OR_RETURN(const std::uint64_t available, available_bytes());
  if (available == 0) {
    return StorageLevel::kFull;
  }
  return available < limits_.warn_bytes ? StorageLevel::kLow : StorageLevel::kOk;
}

}  // namespace trigmesh
