#pragma once
// Ctrl-C and SIGTERM as a question that loops can ask.

namespace imrig {

void catch_stop_signals();  // SIGINT, SIGTERM, and SIGHUP where it is not ignored
bool stop_asked();

}  // namespace imrig
