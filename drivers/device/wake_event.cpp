#include "drivers/device/wake_event.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <limits>

#include <sys/eventfd.h>
#include <unistd.h>

namespace trigmesh {

WakeEvent::WakeEvent() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

void WakeEvent::set() noexcept {
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the flag is set.
  (void)!::write(fd_.get(), &one, sizeof one);
}

void WakeEvent::clear() noexcept {
  std::uint64_t count = 0;
  (void)!::read(fd_.get(), &count, sizeof count);  // fails only when the flag is not set
}

bool WakeEvent::is_set() const noexcept {
  pollfd entry{fd_.get(), POLLIN, 0};
  return ::poll(&entry, 1, 0) == 1;
}

int poll_milliseconds(std::chrono::nanoseconds timeout) {
  constexpr std::int64_t kMost = std::numeric_limits<int>::max();
  const std::int64_t whole = std::chrono::ceil<std::chrono::milliseconds>(timeout).count();
  return static_cast<int>(std::clamp<std::int64_t>(whole, 0, kMost));
}

std::chrono::nanoseconds deadline_after(std::chrono::nanoseconds now,
                                        std::chrono::nanoseconds timeout) {
  const std::chrono::nanoseconds room = std::chrono::nanoseconds::max() - now;
  return now + std::min(timeout, room);
}

int poll_until(std::span<pollfd> descriptors,
               std::chrono::nanoseconds timeout,
               const Clock& clock) {
  const std::chrono::nanoseconds begin = clock.now();
  while (true) {
    const std::chrono::nanoseconds left = timeout - (clock.now() - begin);
    const int ready = ::poll(descriptors.data(), descriptors.size(), poll_milliseconds(left));
    if (ready >= 0 || errno != EINTR) {
      return ready >= 0 ? ready : -errno;
    }
  }
}

}  // namespace trigmesh
