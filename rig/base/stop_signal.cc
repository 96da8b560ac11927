#include "rig/base/stop_signal.h"

#include <csignal>
#include <initializer_list>

namespace imrig {

namespace {

volatile std::sig_atomic_t asked = 0;
extern "C" void on_stop_signal(int) { asked = 1; }

}  // namespace

void catch_stop_signals() {
  struct sigaction action = {}, present = {};
  action.sa_handler = on_stop_signal;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    ::sigaction(signal, nullptr, &present);
    if (signal == SIGHUP && present.sa_handler == SIG_IGN) continue;  // nohup
    ::sigaction(signal, &action, nullptr);
  }
  std::signal(SIGPIPE, SIG_IGN);  // a reader that went away must not end a running rig
}

bool stop_asked() { return asked != 0; }

}  // namespace imrig
