// The viewer as a process: a web page on loopback. It hears what scene_channels.hpp lists, HEALTH
// and LOG among it.
#include "services/viewer/adapter.hpp"

int main(int argc, char** argv) {
  return understory::bus::run_service(
      understory::viewer::viewer_service({
          .map_request = "MAP_REQUEST",  // out: asks for MAP where it came late
      }),
      argc, argv);
}
