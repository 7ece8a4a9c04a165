#include "tools/trigmesh/interrupt.hpp"

#include <array>
#include <cstdint>

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "firmware/base/check.hpp"

namespace trigmesh {

InterruptWatch::InterruptWatch() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, &mask_before_);
  signal_fd_ = signalfd(-1, &signals_, SFD_CLOEXEC);
  end_fd_ = eventfd(0, EFD_CLOEXEC);
  TM_CHECK(signal_fd_ >= 0 && end_fd_ >= 0);
  waiter_ = std::jthread([this] { wait(); });
}

InterruptWatch::~InterruptWatch() {
  const std::uint64_t one = 1;
  TM_CHECK(::write(end_fd_, &one, sizeof(one)) == sizeof(one));
  waiter_.join();
  ::close(signal_fd_);
  ::close(end_fd_);
  pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
}

void InterruptWatch::wait() {
  std::array<pollfd, 2> watched{pollfd{signal_fd_, POLLIN, 0}, pollfd{end_fd_, POLLIN, 0}};
  while (true) {
    ::poll(watched.data(), watched.size(), -1);
    if ((watched[1].revents & POLLIN) != 0) {
      return;
    }
    signalfd_siginfo info;
    if ((watched[0].revents & POLLIN) != 0 &&
        ::read(signal_fd_, &info, sizeof(info)) == sizeof(info)) {
      interrupted_.request_stop();
      watched[0].fd = -1;
      // From now on a signal takes its default action, in this thread.
      pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
    }
  }
}

}  // namespace trigmesh
