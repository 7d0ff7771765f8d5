// The viewer as a process: a web page on loopback. It hears what scene_channels.hpp lists, HEALTH
// and LOG among it, and publishes nothing but its own HEALTH, LOG and CONFIG.
#include "services/viewer/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(understory::viewer::viewer_service(), argc, argv);
}
