#pragma once

#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

namespace trigmesh {

/// The calling thread, and those that it will start: with a name of at most 15 letters, hearing no
/// signals, and at a lower priority. Linux keeps the niceness per thread; raising it is always
/// allowed.
inline void become_background_thread(const char* name, int nice) {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);
  pthread_setname_np(pthread_self(), name);
  (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), nice);
}

}  // namespace trigmesh
